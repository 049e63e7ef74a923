// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>

#include "core/toml_table.hpp"
#include "core/whole_file.hpp"
#include "quadrature_reader/homing_watch.hpp"

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;
namespace {

core::Result<std::map<std::string, HomingRecord>> read_records(const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(core::TomlTable root, core::read_toml(path, "a homing record"));
  std::map<std::string, HomingRecord> records;
  for (const std::string& joint : root.unread_keys()) {
    auto table = root.table(joint);
    if (!table) break;
    HomingRecord& record = records[joint];
    record.stop_counts = table->number("stop_counts", {-1e18, 1e18});
    record.spread_counts = table->number("spread_counts", {0.0, 1e18});
    record.index_counts = table->find_integer("index_counts");
    RAVENCAL_RETURN_IF_ERROR(table->finish());
  }
  RAVENCAL_RETURN_IF_ERROR(root.finish());
  return records;
}

}  // namespace

core::Result<std::map<std::string, HomingRecord>> load_homing_records(const fs::path& path) {
  if (!fs::exists(path)) return std::map<std::string, HomingRecord>();
  auto records = read_records(path);
  if (records.ok()) return records;
  return core::Error{
      records.error().code,
      fmt::format("{}; remove the file to forget earlier homings", records.error().message)};
}

core::Status save_homing_records(const fs::path& path,
                                 const std::map<std::string, HomingRecord>& records) {
  std::string text = "# Hard stops of the last homing, written by ravencal-encoders --home.\n";
  for (const auto& [joint, record] : records) {
    fmt::format_to(std::back_inserter(text),
                   "[\"{}\"]\nstop_counts = {:.1f}\nspread_counts = {:.3f}\n", joint,
                   record.stop_counts, record.spread_counts);
    if (record.index_counts) text += fmt::format("index_counts = {}\n", *record.index_counts);
  }
  return core::write_whole_file(path, text);
}

}  // namespace ravencal::quadrature_reader
