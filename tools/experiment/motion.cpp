// SPDX-License-Identifier: Apache-2.0
#include "experiment/motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ravencal::experiment {
namespace {

using diagnose::Exercise;
using diagnose::Explored;
using Eigen::Vector3d;
using trajectory::Trajectory;

/// Shares of the fastest recorded speed.
constexpr double kSlow = 1.0 / 9.0, kCalm = 1.0 / 3.0, kUsual = 1.0;

/// Half cosines from point to point, at most at a share of the bounds' speeds.
class Path {
 public:
  Path(const MotionBounds& bounds, const Vector3d& start)
      : bounds_(bounds), path_{{0.0}, {start}} {}

  void move(const Vector3d& to, double share) {
    const Vector3d from = path_.joints_ji.back();
    const Vector3d mean_s = (to - from).cwiseAbs().cwiseQuotient(share * bounds_.fastest_ji);
    const auto samples =
        std::max(2L, std::lround(std::ceil(0.5 * std::numbers::pi * trajectory::kSampleRateHz *
                                           mean_s.maxCoeff())));
    const double start_s = path_.t_s.back();
    for (long i = 1; i <= samples; ++i) {
      const double done = static_cast<double>(i) / static_cast<double>(samples);
      path_.t_s.push_back(start_s + static_cast<double>(i) / trajectory::kSampleRateHz);
      path_.joints_ji.push_back(from +
                                0.5 * (1.0 - std::cos(std::numbers::pi * done)) * (to - from));
    }
  }

  void hold(double seconds) {
    path_.t_s.push_back(path_.t_s.back() + seconds);
    path_.joints_ji.push_back(path_.joints_ji.back());
  }

  void follow(const Trajectory& other) {
    const double start_s = path_.t_s.back();
    for (std::size_t i = 1; i < other.t_s.size(); ++i) {
      path_.t_s.push_back(start_s + other.t_s[i]);
      path_.joints_ji.push_back(other.joints_ji[i]);
    }
  }

  [[nodiscard]] Trajectory taken() && { return std::move(path_); }

 private:
  const MotionBounds& bounds_;
  Trajectory path_;
};

/// A zig-zag whose fastest joint moves at this share of its bound.
core::Result<Trajectory> zigzag(const MotionBounds& bounds, double share) {
  trajectory::ZigzagOptions options;
  options.divisions = 2;
  options.limits = bounds.range;
  RAVENCAL_ASSIGN_OR_RETURN(Trajectory t, trajectory::make_zigzag(options));
  Vector3d peak = Vector3d::Zero();
  for (std::size_t i = 1; i < t.t_s.size(); ++i)
    peak =
        peak.cwiseMax((t.joints_ji[i] - t.joints_ji[i - 1]).cwiseAbs() / (t.t_s[i] - t.t_s[i - 1]));
  const double slower = peak.cwiseQuotient(share * bounds.fastest_ji).maxCoeff();
  for (double& t_s : t.t_s) t_s *= slower;
  Trajectory sampled;
  const auto count = static_cast<long>(t.duration_s() * trajectory::kSampleRateHz);
  for (long i = 0; i <= count; ++i) {
    sampled.t_s.push_back(static_cast<double>(i) / trajectory::kSampleRateHz);
    sampled.joints_ji.push_back(t.at(sampled.t_s.back()));
  }
  return sampled;
}

Trajectory holds(const MotionBounds& bounds, Path path) {
  const Vector3d span = bounds.range.high_ji - bounds.range.low_ji;
  for (const double at : {0.1, 0.9}) {
    path.move(bounds.range.low_ji + at * span, kCalm);
    path.hold(180.0);
  }
  return std::move(path).taken();
}

Trajectory reversals(const MotionBounds& bounds, Path path) {
  const Vector3d span = bounds.range.high_ji - bounds.range.low_ji;
  for (const double at : {0.2, 0.5, 0.8}) {
    path.move(bounds.range.low_ji + at * span, kCalm);
    for (const double width : {0.001, 0.005, 0.025, 0.12})
      for (int k = 0; k < 10; ++k)
        path.move(bounds.range.low_ji + (at + (k % 2 == 0 ? 0.5 : -0.5) * width) * span, kCalm);
  }
  return std::move(path).taken();
}

Trajectory one_by_one(const MotionBounds& bounds, Path path) {
  const Vector3d middle = 0.5 * (bounds.range.low_ji + bounds.range.high_ji);
  for (Eigen::Index j = 0; j < 3; ++j) {
    for (int k = 0; k < 4; ++k) {
      Vector3d to = middle;
      to[j] = (k % 2 == 0 ? bounds.range.high_ji : bounds.range.low_ji)[j];
      path.move(to, kUsual);
    }
    path.move(middle, kUsual);
  }
  return std::move(path).taken();
}

}  // namespace

core::Result<MotionBounds> bounds_of(const std::vector<Explored>& explored,
                                     const physics::Plant& plant) {
  if (plant.joints.size() != 3)
    return core::data_error(
        fmt::format("{}: trajectories are of arms of three joints, and this plant has {}",
                    plant.source, plant.joints.size()));
  MotionBounds out;
  for (Eigen::Index j = 0; j < 3; ++j) {
    const std::string& name = plant.joints[static_cast<std::size_t>(j)].name;
    const auto seen = std::find_if(explored.begin(), explored.end(),
                                   [&](const Explored& e) { return e.joint == name; });
    if (seen == explored.end() || !(seen->position.second > seen->position.first) ||
        !(seen->fastest > 0.0))
      return core::data_error(fmt::format(
          "joint {} did not move in the diagnosed recordings, so that no range is known in which "
          "it may",
          name));
    out.range.low_ji[j] = seen->position.first;
    out.range.high_ji[j] = seen->position.second;
    out.fastest_ji[j] = seen->fastest;
  }
  return out;
}

core::Result<Trajectory> motion_of(Exercise motion, const MotionBounds& bounds) {
  Path path(bounds, 0.5 * (bounds.range.low_ji + bounds.range.high_ji));
  switch (motion) {
    case Exercise::kLoaded:
      return zigzag(bounds, 1.0);
    case Exercise::kSpeeds: {
      RAVENCAL_ASSIGN_OR_RETURN(const Trajectory slow, zigzag(bounds, kSlow));
      RAVENCAL_ASSIGN_OR_RETURN(const Trajectory fast, zigzag(bounds, 1.0));
      path.move(slow.joints_ji.front(), kCalm);
      path.follow(slow);
      path.move(fast.joints_ji.front(), kCalm);
      path.follow(fast);
      return std::move(path).taken();
    }
    case Exercise::kHolds:
      return holds(bounds, std::move(path));
    case Exercise::kReversals:
      return reversals(bounds, std::move(path));
    case Exercise::kOneByOne:
      return one_by_one(bounds, std::move(path));
    case Exercise::kWholeRange:
      for (int k = 0; k < 20; ++k)
        path.move(k % 2 == 0 ? bounds.range.high_ji : bounds.range.low_ji, kCalm);
      return std::move(path).taken();
    case Exercise::kNone:
      break;
  }
  return core::Error{core::ErrorCode::kUsage, "this experiment has no motion of its own"};
}

}  // namespace ravencal::experiment
