// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/constants.hpp"
#include "core/random.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::trajectory {
namespace {

using core::Random;

constexpr double kLongestS = 24.0 * 3600.0;

/// run_r2_random_joint_movement.py: bands of the turning points and of the speed, per joint.
struct Band {
  double low_from, low_to, high_from, high_to;  // rad or m
  double speed_from, speed_to;                  // per second
  double slowest;                               // the script's floor of the command
};
constexpr std::array<Band, 3> kBands = {{
    {20 * core::kRadPerDeg, 25 * core::kRadPerDeg, 55 * core::kRadPerDeg, 60 * core::kRadPerDeg,
     1.091 * core::kRadPerDeg, 3.0 * core::kRadPerDeg, 0.2 * core::kRadPerDeg},
    {55 * core::kRadPerDeg, 65 * core::kRadPerDeg, 100 * core::kRadPerDeg, 110 * core::kRadPerDeg,
     1.5 * core::kRadPerDeg, 4.0 * core::kRadPerDeg, 0.2 * core::kRadPerDeg},
    {0.33, 0.35, 0.40, 0.42, 0.0025, 0.007, 0.001},
}};
/// Of a range and of its greatest speed: what the authors' bands are of their workspace's, to a few
/// per cent (low 5 of 40 deg, speed from 1.091 of 3 deg/s, floor 0.2 of 3 deg/s).
constexpr double kTurningShare = 0.125, kSlowestShare = 0.36, kFloorShare = 0.067;
constexpr int kScriptRateHz = 1000;
constexpr double kRampLoops = 1200.0;  // the script's ramp after a turning point, in its loops

/// One joint of the authors' script: runs to its target, then takes the opposite one.
class Bouncer {
 public:
  Bouncer(const Band& band, Random& random)
      : band_(band), position_(random.uniform(band.low_from, band.high_to)) {
    upward_ = random.uniform() < 0.5;
    take_target(random);
  }

  double step(Random& random) {
    const double distance = target_ - position_;
    if ((upward_ && distance <= kTolerance) || (!upward_ && distance >= -kTolerance)) {
      upward_ = !upward_;
      take_target(random);
      return position_;
    }
    const double speed = std::clamp(std::abs(distance), band_.slowest, speed_);
    const double ramp = std::min(1.0, ++loops_ / kRampLoops);
    const double move = speed * ramp / kScriptRateHz;
    position_ += upward_ ? std::min(move, distance) : -std::min(move, -distance);
    return position_;
  }

 private:
  static constexpr double kTolerance = 1e-9;

  void take_target(Random& random) {
    target_ = upward_ ? random.uniform(band_.high_from, band_.high_to)
                      : random.uniform(band_.low_from, band_.low_to);
    speed_ = random.uniform(band_.speed_from, band_.speed_to);
    loops_ = 0.0;
  }

  Band band_;
  double position_;
  double target_ = 0.0;
  double speed_ = 0.0;
  double loops_ = 0.0;
  bool upward_ = true;
};

/// One joint of the paper's wording: half cosines; each cycle's ends and mean speed are random.
class CosineWalker {
 public:
  CosineWalker(const Band& band, Random& random) : band_(band) {
    upward_ = random.uniform() < 0.5;
    to_ = upward_ ? random.uniform(band.low_from, band.low_to)
                  : random.uniform(band.high_from, band.high_to);
    take_target(random);
    phase_s_ = random.uniform() * duration_s_;
  }

  double step(double dt_s, Random& random) {
    phase_s_ += dt_s;
    if (phase_s_ >= duration_s_) {
      phase_s_ -= duration_s_;
      upward_ = !upward_;
      take_target(random);
    }
    const double blend = 0.5 * (1.0 - std::cos(std::numbers::pi * phase_s_ / duration_s_));
    return from_ + blend * (to_ - from_);
  }

 private:
  void take_target(Random& random) {
    from_ = to_;
    to_ = upward_ ? random.uniform(band_.high_from, band_.high_to)
                  : random.uniform(band_.low_from, band_.low_to);
    // The speed band bounds the fastest moment, pi/2 times the mean of a half cosine.
    const double peak = random.uniform(band_.speed_from, band_.speed_to);
    duration_s_ = std::abs(to_ - from_) * std::numbers::pi / (2.0 * peak);
  }

  Band band_;
  double from_ = 0.0;
  double to_ = 0.0;
  double duration_s_ = 1.0;
  double phase_s_ = 0.0;
  bool upward_ = true;
};

std::vector<Band> bands_of(const std::optional<JointLimits>& limits) {
  if (!limits) return {kBands.begin(), kBands.end()};
  std::vector<Band> bands;
  for (Eigen::Index j = 0; j < limits->low_ji.size(); ++j) {
    const double low = limits->low_ji[j], high = limits->high_ji[j];
    const double fastest = limits->fastest_ji[j], turns = kTurningShare * (high - low);
    bands.push_back({low, low + turns, high - turns, high, kSlowestShare * fastest, fastest,
                     kFloorShare * fastest});
  }
  return bands;
}

Band at_pace(Band band, double pace) {
  band.speed_from *= pace;
  band.speed_to *= pace;
  band.slowest *= pace;
  return band;
}

std::vector<double> run_joint(const Band& band, const RandomOptions& options, std::size_t count,
                              Random& random) {
  constexpr int kLoopsPerSample = kScriptRateHz / static_cast<int>(kSampleRateHz);
  std::vector<double> positions(count);
  if (options.mode == RandomMode::kPaper) {
    CosineWalker walker(band, random);
    for (double& position : positions) position = walker.step(1.0 / kSampleRateHz, random);
    return positions;
  }
  Bouncer bouncer(band, random);
  for (double& position : positions) {
    for (int loop = 0; loop < kLoopsPerSample; ++loop) position = bouncer.step(random);
  }
  return positions;
}

}  // namespace

core::Status check_pace(double pace) {
  constexpr double kLeast = 0.1;
  constexpr double kMost = 10.0;
  if (pace >= kLeast && pace <= kMost) return {};
  return core::Error{core::ErrorCode::kUsage,
                     fmt::format("pace {} is outside {} to {}", pace, kLeast, kMost)};
}

core::Result<Trajectory> make_random(const RandomOptions& options) {
  if (!(options.duration_s >= 1.0) || options.duration_s > kLongestS) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("duration {} s is outside 1 s to 24 h", options.duration_s)};
  }
  RAVENCAL_RETURN_IF_ERROR(check_pace(options.pace));
  const auto count = static_cast<std::size_t>(options.duration_s * kSampleRateHz) + 1;
  const std::vector<Band> bands = bands_of(options.limits);
  Trajectory trajectory;
  if (options.limits) trajectory.joints = options.limits->joints;
  trajectory.t_s.resize(count);
  trajectory.joints_ji.assign(count, Eigen::VectorXd(static_cast<Eigen::Index>(bands.size())));
  for (std::size_t i = 0; i < count; ++i)
    trajectory.t_s[i] = static_cast<double>(i) / kSampleRateHz;
  for (std::size_t joint = 0; joint < bands.size(); ++joint) {
    Random random(options.seed * bands.size() + joint);
    const std::vector<double> positions =
        run_joint(at_pace(bands[joint], options.pace), options, count, random);
    for (std::size_t i = 0; i < count; ++i) {
      trajectory.joints_ji[i][static_cast<Eigen::Index>(joint)] = positions[i];
    }
  }
  return trajectory;
}

}  // namespace ravencal::trajectory
