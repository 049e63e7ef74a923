// SPDX-License-Identifier: Apache-2.0
//
// Between NumPy and the libraries.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <utility>
#include <vector>

#include "record/table.hpp"

namespace ravencal::python {

namespace py = pybind11;

/// NumPy's view of numbers that `owner` holds and the view keeps alive. Strides in bytes.
template <typename T>
py::array read_only_view(const T* data, std::vector<py::ssize_t> shape,
                         std::vector<py::ssize_t> strides, py::handle owner) {
  py::array_t<T> view(std::move(shape), std::move(strides), data, owner);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

/// The view of a vector that `owner` holds.
template <typename T>
py::array read_only_view(const std::vector<T>& values, py::handle owner) {
  return read_only_view(values.data(), {static_cast<py::ssize_t>(values.size())}, {sizeof(T)},
                        owner);
}

/// Arrays by name as a table of that name; an array [rows, k] is k columns NAME[0] .. NAME[k-1].
/// Throws where a value is no array of numbers or a name stands twice.
record::Table table_of(const py::dict& arrays, const std::string& name);

}  // namespace ravencal::python
