// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Rows with from_s <= time < to_s; times count from the recording's first row. Unset: no limit.
struct TimeRange {
  std::optional<double> from_s;
  std::optional<double> to_s;
};

/// Drops the rows and events outside, and says so in meta `from_s` and `to_s`, which count from the
/// first row of the file that was cut first. Errors (kUsage): the range is empty; no row is left.
core::Status cut_to(Recording& recording, const TimeRange& range);

}  // namespace ravencal::record
