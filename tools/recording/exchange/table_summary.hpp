// SPDX-License-Identifier: Apache-2.0
//
// What the columns of a foreign file are like, for whoever writes a profile.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "record/table.hpp"

namespace ravencal::exchange {

struct ColumnSummary {
  std::string name;
  std::size_t rows = 0;
  double min = 0.0;  ///< in the file's unit, of the values that are numbers; NaN if none is
  double max = 0.0;
  std::size_t lost = 0;            ///< NaN, empty or words
  std::vector<std::string> words;  ///< different ones among the first texts, a few
  /// Median step of values that never fall, as those of a time; 0 for other columns.
  double step = 0.0;
};

std::vector<ColumnSummary> summarise(const record::Table& table);

/// In words for a person, several lines.
std::string describe_in_words(const record::Table& table);

/// The same as JSON; keys are in FORMATS.md.
std::string describe_in_json(const record::Table& table);

}  // namespace ravencal::exchange
