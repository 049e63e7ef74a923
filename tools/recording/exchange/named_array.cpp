// SPDX-License-Identifier: Apache-2.0
#include "exchange/named_array.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>
#include <optional>
#include <set>
#include <utility>

namespace ravencal::exchange {
namespace {

/// Rows and columns, or nothing for an array of more dimensions. One row of several columns is a
/// vector that lies.
std::optional<std::pair<std::size_t, std::size_t>> rows_and_columns(
    const std::vector<std::size_t>& shape) {
  const std::size_t first = shape.empty() ? 1 : shape[0];
  if (shape.size() < 2) return std::pair{first, std::size_t{1}};
  if (shape.size() > 2) return std::nullopt;
  return first == 1 ? std::pair{shape[1], std::size_t{1}} : std::pair{first, shape[1]};
}

}  // namespace

void add_columns(record::Table& table, NamedArray array) {
  const auto leave_out = [&](std::string why) { table.left_out[array.name] = std::move(why); };
  if (!array.unreadable.empty()) return leave_out(array.unreadable);
  const auto size = rows_and_columns(array.shape);
  if (!size) {
    return leave_out(fmt::format("its shape is {}; a column needs one dimension, or two: rows, k",
                                 fmt::join(array.shape, " x ")));
  }
  const auto [rows, columns] = *size;
  if (columns == 1) {
    std::vector<double> values = std::move(array.values);
    if (!array.texts.empty()) values.assign(rows, std::numeric_limits<double>::quiet_NaN());
    table.columns.push_back({array.name, std::move(values), std::move(array.texts)});
    return;
  }
  if (!array.texts.empty()) return leave_out("it is a table of texts");
  if (columns > record::kMostChannels) {
    return leave_out(fmt::format(
        "its shape is {} x {}, and rows come first, so that it would be {} columns; transpose it",
        rows, columns, columns));
  }
  for (std::size_t k = 0; k < columns; ++k) {
    record::TableColumn& column = table.columns.emplace_back();
    column.name = fmt::format("{}[{}]", array.name, k);
    column.values.resize(rows);
    for (std::size_t row = 0; row < rows; ++row)
      column.values[row] = array.values[array.is_column_major ? k * rows + row : row * columns + k];
  }
}

core::Status check_names(const record::Table& table) {
  std::set<std::string> names;
  for (const record::TableColumn& column : table.columns) {
    if (names.insert(column.name).second) continue;
    return core::data_error(
        fmt::format("{}: two columns are called '{}'", table.path.string(), column.name));
  }
  return {};
}

core::Status check_is_there(const std::filesystem::path& path) {
  std::error_code failure;
  const std::uintmax_t bytes = std::filesystem::file_size(path, failure);
  if (failure)
    return core::io_error(fmt::format("{}: cannot open: {}", path.string(), failure.message()));
  return bytes > 0 ? core::Status()
                   : core::data_error(fmt::format("{}: the file is empty", path.string()));
}

}  // namespace ravencal::exchange
