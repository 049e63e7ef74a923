// SPDX-License-Identifier: Apache-2.0
#include "python/arrays.hpp"

#include <fmt/format.h>

#include "exchange/named_array.hpp"
#include "python/module.hpp"

namespace ravencal::python {

record::Table table_of(const py::dict& arrays, const std::string& name) {
  record::Table table;
  table.path = name;
  for (const auto& [key, value] : arrays) {
    exchange::NamedArray array;
    array.name = py::cast<std::string>(key);
    const auto numbers =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
    if (!numbers) {
      PyErr_Clear();
      throw Failure(
          core::data_error(fmt::format("{}: '{}' is no array of numbers", name, array.name)));
    }
    for (py::ssize_t i = 0; i < numbers.ndim(); ++i)
      array.shape.push_back(static_cast<std::size_t>(numbers.shape(i)));
    array.values.assign(numbers.data(), numbers.data() + numbers.size());
    exchange::add_columns(table, std::move(array));
  }
  succeed(exchange::check_names(table));
  return table;
}

}  // namespace ravencal::python
