// SPDX-License-Identifier: Apache-2.0
//
// A profile for a table that nobody has described yet: what each column is, by its name and by what
// its values say of the other columns.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/table.hpp"

namespace ravencal::guess {

/// One column that becomes a channel.
struct GuessedChannel {
  std::size_t column = 0;  ///< of the table
  std::string name;        ///< "elbow.velocity"
  std::string role;        ///< of record/channel.hpp
  std::string joint;       ///< may be empty
  std::string unit;        ///< of core/units.hpp
  double scale = 1.0;      ///< `unit` per unit of the file, with the sign
  double wraps_at = 0.0;   ///< in the unit of the file; 0: it does not
  bool may_be_missing = false;
  bool assumed = false;  ///< nothing in the file says its unit, its joint or its sign
  std::string because;   ///< what the guess rests on
};

struct LeftColumn {
  std::size_t column = 0;
  std::string why;
};

struct Guess {
  std::optional<std::size_t> time_column;    ///< none: the table's stamps, or rows are
                                             ///< counted
  std::optional<std::size_t> time_fraction;  ///< column of the time's fraction
  record::Clock clock;
  bool time_unit_assumed = false;  ///< no word of the file says the unit of its time
  bool time_restarts = false;
  std::size_t rows = 0;
  double row_period_s = 0.0;  ///< median step
  std::vector<GuessedChannel> channels;
  std::vector<LeftColumn> left_out;
  std::vector<std::string> questions;  ///< one for each doubt, whatever the number of its columns
};

/// `joints`: names of the plant's joints, in its order; empty: the columns' own words name them.
/// Errors (kData): no column that can be a position; fewer than ten rows.
core::Result<Guess> guess_profile(const record::Table& table,
                                  const std::vector<std::string>& joints);

/// The profile as text, each channel with what it rests on.
std::string profile_text(const Guess& guess, const record::Table& table);

/// The same for people: a line a column, what was left out, and what to check.
std::string describe(const Guess& guess, const record::Table& table);

}  // namespace ravencal::guess
