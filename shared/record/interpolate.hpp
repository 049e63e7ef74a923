// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

namespace ravencal::record {

/// Reads a series at increasing instants, linear in between. Instants may step back; that costs a
/// search. NaN outside the series, next to a NaN, or across a gap longer than `longest_gap_ns`.
class Interpolator {
 public:
  Interpolator(std::span<const std::int64_t> t_ns, std::span<const double> values,
               std::int64_t longest_gap_ns)
      : t_ns_(t_ns), values_(values), longest_gap_ns_(static_cast<double>(longest_gap_ns)) {}

  /// `origin_ns` + `offset_ns`: the instant, split so that the fraction of a ns survives.
  double at(std::int64_t origin_ns, double offset_ns) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const std::int64_t t = origin_ns + static_cast<std::int64_t>(std::floor(offset_ns));
    if (t_ns_.size() < 2 || t < t_ns_.front() || t >= t_ns_.back()) return kNone;
    if (t < t_ns_[i_] || t >= t_ns_[std::min(i_ + kNear, t_ns_.size() - 1)]) {
      i_ = static_cast<std::size_t>(std::upper_bound(t_ns_.begin(), t_ns_.end(), t) -
                                    t_ns_.begin()) -
           1;
    }
    while (t_ns_[i_ + 1] <= t) ++i_;
    const auto span_ns = static_cast<double>(t_ns_[i_ + 1] - t_ns_[i_]);
    if (span_ns > longest_gap_ns_) return kNone;
    const double share = (static_cast<double>(origin_ns - t_ns_[i_]) + offset_ns) / span_ns;
    return values_[i_] + (values_[i_ + 1] - values_[i_]) * share;
  }

 private:
  static constexpr std::size_t kNear = 64;  // walk this far before searching
  std::span<const std::int64_t> t_ns_;
  std::span<const double> values_;
  double longest_gap_ns_;
  std::size_t i_ = 0;
};

}  // namespace ravencal::record
