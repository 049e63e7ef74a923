// SPDX-License-Identifier: Apache-2.0
//
// Numbers that a recording's meta holds as texts. Private to record/.
#pragma once

#include <cstdint>
#include <string>

#include "record/recording.hpp"

namespace ravencal::record {

/// A time in s; 0 where meta has none under that key, or none that 64 bits of ns hold.
double seconds_in_meta(const Recording& recording, const std::string& key);

/// What to add to t_ns to have wall time: recordings of foreign files count from their first row,
/// and keep its stamp in meta.
std::int64_t wall_origin_ns(const Recording& recording);

}  // namespace ravencal::record
