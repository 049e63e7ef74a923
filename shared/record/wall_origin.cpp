// SPDX-License-Identifier: Apache-2.0
#include "record/wall_origin.hpp"

#include <cmath>
#include <cstdlib>

#include "record/csv_number.hpp"

namespace ravencal::record {

double seconds_in_meta(const Recording& recording, const std::string& key) {
  constexpr double kMost_s = 9e9;
  const auto found = recording.meta.find(key);
  const double value_s = found == recording.meta.end() ? 0.0 : number_of(found->second).value_or(0);
  return std::abs(value_s) <= kMost_s ? value_s : 0.0;
}

std::int64_t wall_origin_ns(const Recording& recording) {
  constexpr std::int64_t kSecondNs = 1'000'000'000;
  if (!recording.meta.contains("origin.time") || recording.t_ns.empty()) return 0;
  const auto stamp_ns =
      static_cast<std::int64_t>(std::llround(1e9 * seconds_in_meta(recording, "origin.time")));
  const std::int64_t shift = stamp_ns - recording.t_ns.front();
  return std::abs(shift) < kSecondNs ? 0 : shift;
}

}  // namespace ravencal::record
