// SPDX-License-Identifier: Apache-2.0
#include "diagnose/simulated_channel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// What the channel's residual follows first: friction and inertia the speed, cables the position.
VectorXd followed_motion(const Series& series) {
  if (series.stage == Stage::kDrive) return series.motion.v;
  if (series.stage == Stage::kTracking) return series.motion.q + series.y;
  return series.motion.q;
}

/// What a simulation may have copied: filters differ between two motions, signals do not.
const VectorXd& unfiltered(const Series& series) {
  return series.recorded.size() > 0 ? series.recorded : series.y;
}

/// Of values one after the other (Welford, 1962).
class Spread {
 public:
  void add(double x) {
    count_ += 1.0;
    const double from_mean = x - mean_;
    mean_ += from_mean / count_;
    squares_ += from_mean * (x - mean_);
  }
  [[nodiscard]] double deviation() const { return std::sqrt(squares_ / std::max(1.0, count_)); }

 private:
  double count_ = 0.0, mean_ = 0.0, squares_ = 0.0;
};

}  // namespace

Difference difference_of(const Series& recorded, const Series& simulated) {
  const VectorXd a = followed_motion(recorded);
  const VectorXd b = followed_motion(simulated);
  const VectorXd& x = unfiltered(recorded);
  const VectorXd& y = unfiltered(simulated);
  double signal = 0.0;
  Spread measured, moved, apart;
  Difference out;
  for (Index i = 0; i < recorded.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool known = recorded.valid[n] != 0 && simulated.valid[n] != 0;
    if (!known || !std::isfinite(x[i] - y[i])) continue;
    ++out.rows;
    signal += std::pow(x[i] - y[i], 2);
    measured.add(x[i]);
    moved.add(a[i]);
    apart.add(a[i] - b[i]);
  }
  out.signal = std::sqrt(signal / static_cast<double>(std::max<Index>(1, out.rows)));
  out.measured = measured.deviation();
  out.moved = moved.deviation();
  out.motion = apart.deviation();
  return out;
}

std::string channel_words(const Series& series) {
  return fmt::format("joint {} ({})", series.joint,
                     series.stage == Stage::kTracking ? "tracking" : stage_word(series.stage));
}

std::string motion_words(const Series& series, const Difference& d) {
  const core::DisplayUnit unit = core::display_unit(series.prismatic ? "m" : "rad");
  const bool speed = series.stage == Stage::kDrive;
  return fmt::format("{} differs by {:.3g} of {:.3g} {}{} RMS", speed ? "speed" : "position",
                     d.motion * unit.per_si, d.moved * unit.per_si, unit.name, speed ? "/s" : "");
}

std::string incomparable(const Series& series, const Difference& d) {
  const bool drive = series.stage == Stage::kDrive;
  if (d.rows == 0) return "the simulation has no row in common with the recording";
  if (d.copied()) {
    return fmt::format(
        "the simulation has the recorded {} ({:.2g} of it differs), so that nothing is left to "
        "compare; {}",
        drive ? "effort" : "error", d.measured > 0.0 ? d.signal / d.measured : 0.0,
        drive ? "to compare efforts, give an inverse simulation, which computes the effort of the "
                "recorded motion"
              : "give a simulation that computes the joint from the motor");
  }
  if (d.missed() > kMostMotionMissed) {
    return fmt::format(
        "the simulation moves too differently to be compared row by row: its {}, {:.0f} % of the "
        "variance, and {:.0f} % is the most; give an inverse simulation, or start the simulation "
        "anew from the recorded state more often",
        motion_words(series, d), 100.0 * d.missed(), 100.0 * kMostMotionMissed);
  }
  return {};
}

}  // namespace ravencal::diagnose
