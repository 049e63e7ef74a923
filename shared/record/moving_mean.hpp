// SPDX-License-Identifier: Apache-2.0
//
// Mean of a series, linear between its points, over a window around any instant. Unlike plain
// interpolation its noise does not depend on where the instant lies between two points, so that a
// search over delays is not drawn away from multiples of the sampling period.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace ravencal::record {

class MovingMean {
 public:
  /// The window reaches `half_ns` to either side. NaN and gaps above `longest_gap_ns` are unknown.
  MovingMean(std::span<const std::int64_t> t_ns, std::span<const double> values, double half_ns,
             std::int64_t longest_gap_ns)
      : t_ns_(t_ns),
        values_(values),
        half_ns_(half_ns),
        integral_(t_ns.size(), 0.0),
        broken_(t_ns.size(), 0) {
    for (std::size_t i = 1; i < t_ns.size(); ++i) {
      const std::int64_t span_ns = t_ns[i] - t_ns[i - 1];
      const double area = 0.5 * (values[i] + values[i - 1]) * static_cast<double>(span_ns);
      const bool known = std::isfinite(area) && span_ns <= longest_gap_ns;
      integral_[i] = integral_[i - 1] + (known ? area : 0.0);
      broken_[i] = broken_[i - 1] + (known ? 0 : 1);
    }
  }

  /// Around `origin_ns` + `offset_ns`; NaN where any of the window is unknown.
  [[nodiscard]] double at(std::int64_t origin_ns, double offset_ns) const {
    const Point from = integral_to(origin_ns, offset_ns - half_ns_);
    const Point to = integral_to(origin_ns, offset_ns + half_ns_);
    if (!from.inside || !to.inside || from.broken != to.broken)
      return std::numeric_limits<double>::quiet_NaN();
    return (to.integral - from.integral) / (2.0 * half_ns_);
  }

 private:
  struct Point {
    bool inside = false;
    std::int64_t broken = 0;
    double integral = 0.0;
  };

  [[nodiscard]] Point integral_to(std::int64_t origin_ns, double offset_ns) const {
    const std::int64_t t = origin_ns + static_cast<std::int64_t>(std::floor(offset_ns));
    if (t_ns_.size() < 2 || t < t_ns_.front() || t >= t_ns_.back()) return {};
    const std::size_t i = segment_of(t);
    const double since_ns = static_cast<double>(origin_ns - t_ns_[i]) + offset_ns;
    const double slope =
        (values_[i + 1] - values_[i]) / static_cast<double>(t_ns_[i + 1] - t_ns_[i]);
    // A window that starts or ends in a broken segment is unknown.
    if (broken_[i + 1] != broken_[i]) return {};
    return {true, broken_[i], integral_[i] + (values_[i] + 0.5 * slope * since_ns) * since_ns};
  }

  /// Index of the last point at or before `t`. Recordings are nearly uniform: the guess is close.
  [[nodiscard]] std::size_t segment_of(std::int64_t t) const {
    constexpr std::size_t kNear = 16;
    const std::size_t last = t_ns_.size() - 1;
    const double share =
        static_cast<double>(t - t_ns_.front()) / static_cast<double>(t_ns_.back() - t_ns_.front());
    auto i = static_cast<std::size_t>(share * static_cast<double>(last));
    const std::size_t low = i > kNear ? i - kNear : 0;
    const std::size_t high = std::min(i + kNear, last);
    if (t < t_ns_[low] || t >= t_ns_[high]) {
      return static_cast<std::size_t>(std::upper_bound(t_ns_.begin(), t_ns_.end(), t) -
                                      t_ns_.begin()) -
             1;
    }
    while (t_ns_[i] > t) --i;
    while (t_ns_[i + 1] <= t) ++i;
    return i;
  }

  std::span<const std::int64_t> t_ns_;
  std::span<const double> values_;
  double half_ns_;
  std::vector<double> integral_;      // of values over time, up to each point
  std::vector<std::int64_t> broken_;  // unknown segments up to each point
};

}  // namespace ravencal::record
