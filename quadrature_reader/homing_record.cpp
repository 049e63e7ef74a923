// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <fstream>

#include "quadrature_reader/homing_watch.hpp"
#include "quadrature_reader/toml_table.hpp"

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;

core::Result<std::map<std::string, HomingRecord>> load_homing_records(const fs::path& path) {
  std::map<std::string, HomingRecord> records;
  if (!fs::exists(path)) return records;
  try {
    const toml::table root = toml::parse_file(path.string());
    for (const auto& [joint, node] : root) {
      if (!node.is_table()) continue;
      TomlTable table(*node.as_table(), fmt::format("[{}]", joint.str()), path);
      HomingRecord record;
      record.stop_counts = table.number("stop_counts", -1e18, 1e18).value_or(0.0);
      record.spread_counts = table.number("spread_counts", 0.0, 1e18).value_or(0.0);
      record.index_counts = table.integer("index_counts", INT64_MIN, INT64_MAX);
      RAVENCAL_RETURN_IF_ERROR(table.finish());
      records[std::string(joint.str())] = record;
    }
  } catch (const toml::parse_error& error) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}:{}: {}; remove the file to forget earlier homings",
                                   path.string(), error.source().begin.line, error.description())};
  }
  return records;
}

core::Status save_homing_records(const fs::path& path,
                                 const std::map<std::string, HomingRecord>& records) {
  const fs::path partial = path.string() + ".partial";
  std::ofstream stream(partial);
  stream << "# Hard stops of the last homing, written by ravencal-encoders --home.\n";
  for (const auto& [joint, record] : records) {
    stream << fmt::format("[\"{}\"]\nstop_counts = {:.1f}\nspread_counts = {:.3f}\n", joint,
                          record.stop_counts, record.spread_counts);
    if (record.index_counts) stream << fmt::format("index_counts = {}\n", *record.index_counts);
  }
  stream.close();
  std::error_code failure;
  if (stream) fs::rename(partial, path, failure);
  if (stream && !failure) return {};
  fs::remove(partial, failure);
  return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be written", path.string())};
}

}  // namespace ravencal::quadrature_reader
