// SPDX-License-Identifier: Apache-2.0
//
// A foreign file of named columns in memory, before a profile says which of them is which channel.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

struct TableColumn {
  std::string name;
  std::vector<double> values;      ///< in the file's unit; NaN: lost or no number
  std::vector<std::string> texts;  ///< one a row where the column holds words; else empty
  /// What of the name says joint and quantity, where its topic says nothing of them; empty: all of
  /// it.
  std::string words{};
};

struct Table {
  std::filesystem::path path;
  /// Names are unique. Columns of a CSV or a bag are of one length; arrays of a file may differ.
  std::vector<TableColumn> columns;
  /// False: a CSV without header; the names are the numbers of the columns, from 0, and a profile
  /// gives `header = false` and `index`.
  bool has_header = true;
  /// Stamps of the rows where the file has them beside its columns (bags of ROS 2, which count from
  /// 1970); else empty. A profile without `time` takes them.
  std::vector<std::int64_t> t_ns;
  std::map<std::string, std::string> left_out;  ///< names in the file that are no column, and why
  std::string note;           ///< how the rows came about, where several publishers gave them
  std::vector<Event> events;  ///< rows or messages that --skip-bad left out
};

/// Reads a table through a profile of format "csv", as load_csv does a file; `generic` takes its
/// channels from the names. Uses `skip_bad` of the options. Errors (kData) name file, column, row
/// and value.
core::Result<Recording> load_table(const Table& table, Profile profile, const LoadOptions& options);

}  // namespace ravencal::record
