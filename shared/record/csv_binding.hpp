// SPDX-License-Identifier: Apache-2.0
//
// Binds a profile to the columns of one CSV file. Private to record/.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "record/csv_file.hpp"
#include "record/profile.hpp"

namespace ravencal::record {

/// Which column of the file goes where. Number targets are the profile's channels in order, then
/// the time; word targets are filters, conditions and the episode.
struct CsvBinding {
  std::vector<CsvColumn> columns;
  std::vector<double> factors;  ///< to SI, per channel; the time stays in its unit
  /// A column wanted by several channels is parsed into the first, `second`, and copied to `first`.
  std::vector<std::pair<std::size_t, std::size_t>> copies;
  std::size_t word_count = 0;
  std::vector<std::size_t> filter_words;                    ///< per filter
  std::vector<std::optional<std::size_t>> condition_words;  ///< per channel
  std::optional<std::size_t> episode_word;
  bool has_time = false;
};

/// `first_line` is the header, or the first row of a file without one. Errors name the column.
core::Result<CsvBinding> bind_columns(const Profile& profile, const CsvFile& file,
                                      const std::vector<std::string>& first_line);

}  // namespace ravencal::record
