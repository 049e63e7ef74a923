// SPDX-License-Identifier: Apache-2.0
//
// Binds a profile to the columns of one source. Private to record/.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "record/profile.hpp"
#include "record/table_source.hpp"

namespace ravencal::record {

/// Which column of the source goes where. Number targets are the profile's channels in order, then
/// the time and its fraction; word targets are filters, conditions and the episode.
struct TableBinding {
  std::vector<BoundColumn> columns;
  std::vector<double> factors;  ///< to SI, per channel; the time stays in its unit
  /// A column wanted by several channels is parsed into the first, `second`, and copied to `first`.
  std::vector<std::pair<std::size_t, std::size_t>> copies;
  std::size_t word_count = 0;
  std::vector<std::size_t> filter_words;                    ///< per filter
  std::vector<std::optional<std::size_t>> condition_words;  ///< per channel
  std::optional<std::size_t> episode_word;
  bool has_time = false;
  std::optional<std::size_t> time_word;  ///< of a time that is written out
  bool has_fraction = false;
};

/// Refuses a source in which two columns have one name; those without a name may be several.
core::Status check_names_differ(const TableSource& source);

/// Errors name the column and those that exist, or the two of that name.
core::Result<TableBinding> bind_columns(const Profile& profile, const TableSource& source);

}  // namespace ravencal::record
