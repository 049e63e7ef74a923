// SPDX-License-Identifier: Apache-2.0
#include "exchange/table_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "exchange/hdf5_read.hpp"
#include "exchange/mat_read.hpp"
#include "exchange/mcap.hpp"
#include "exchange/npz.hpp"
#include "exchange/rosbag2.hpp"
#include "record/csv_load.hpp"

namespace ravencal::exchange {
namespace {

using record::LoadOptions;
using record::Table;

core::Result<Table> table_of(const std::filesystem::path& path, std::vector<NamedArray> arrays) {
  Table table;
  table.path = path;
  for (NamedArray& array : arrays) add_columns(table, std::move(array));
  RAVENCAL_RETURN_IF_ERROR(check_names(table));
  return table;
}

template <auto read_arrays>
core::Result<Table> array_table(const std::filesystem::path& path, const LoadOptions&) {
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<NamedArray> arrays, read_arrays(path));
  return table_of(path, std::move(arrays));
}

/// One array has no name, so its columns have numbers, as those of a CSV without header.
core::Result<Table> npy_table(const std::filesystem::path& path, const LoadOptions&) {
  RAVENCAL_ASSIGN_OR_RETURN(NamedArray array, read_npy(path));
  std::vector<NamedArray> arrays;
  arrays.push_back(std::move(array));
  RAVENCAL_ASSIGN_OR_RETURN(Table table, table_of(path, std::move(arrays)));
  table.has_header = false;
  for (std::size_t i = 0; i < table.columns.size(); ++i) table.columns[i].name = std::to_string(i);
  return table;
}

struct TableKind {
  std::string_view extension;
  core::Result<Table> (*read)(const std::filesystem::path&, const LoadOptions&);
};
constexpr std::array kTableKinds = {
    TableKind{".csv", record::read_csv_table},
    TableKind{".npz", array_table<read_npz>},
    TableKind{".npy", npy_table},
    TableKind{".mat", array_table<read_mat>},
    TableKind{".h5", array_table<read_hdf5>},
    TableKind{".hdf5", array_table<read_hdf5>},
    TableKind{".mcap", read_mcap},
    TableKind{".db3", read_rosbag2},
};

const TableKind* kind_of(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  for (const TableKind& kind : kTableKinds) {
    if (kind.extension == extension) return &kind;
  }
  return nullptr;
}

}  // namespace

bool is_table(const std::filesystem::path& path) { return kind_of(path) != nullptr; }

std::vector<std::string> table_extensions() {
  std::vector<std::string> extensions;
  for (const TableKind& kind : kTableKinds) extensions.emplace_back(kind.extension);
  return extensions;
}

core::Result<Table> read_table(const std::filesystem::path& path, const LoadOptions& options) {
  if (const TableKind* const kind = kind_of(path)) return kind->read(path, options);
  return core::usage_error(fmt::format("{}: unknown kind of table; known: {}", path.string(),
                                       fmt::join(table_extensions(), ", ")));
}

}  // namespace ravencal::exchange
