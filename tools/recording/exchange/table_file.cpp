// SPDX-License-Identifier: Apache-2.0
#include "exchange/table_file.hpp"

#include <fmt/format.h>

#include <array>

#include "exchange/npz.hpp"
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

core::Result<Table> npz_table(const std::filesystem::path& path, const LoadOptions&) {
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<NamedArray> arrays, read_npz(path));
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
    TableKind{".npz", npz_table},
    TableKind{".npy", npy_table},
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

core::Result<Table> read_table(const std::filesystem::path& path, const LoadOptions& options) {
  if (const TableKind* const kind = kind_of(path)) return kind->read(path, options);
  std::string known;
  for (const TableKind& kind : kTableKinds) known += " " + std::string(kind.extension);
  return core::usage_error(
      fmt::format("{}: unknown kind of table; known:{}", path.string(), known));
}

}  // namespace ravencal::exchange
