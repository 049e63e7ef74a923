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
using Eigen::VectorXd;
using trajectory::JointLimits;
using trajectory::Trajectory;

/// Shares of the fastest recorded speed.
constexpr double kSlow = 1.0 / 9.0, kCalm = 1.0 / 3.0, kUsual = 1.0;

/// Half cosines from point to point, at most at a share of the bounds' speeds.
class Path {
 public:
  Path(const JointLimits& bounds, const VectorXd& start)
      : bounds_(bounds), path_{bounds.joints, {0.0}, {start}} {}

  void move(const VectorXd& to, double share) {
    const VectorXd from = path_.joints_ji.back();
    const VectorXd mean_s = (to - from).cwiseAbs().cwiseQuotient(share * bounds_.fastest_ji);
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
  const JointLimits& bounds_;
  Trajectory path_;
};

/// At this share of the speeds.
core::Result<Trajectory> zigzag(const JointLimits& bounds, double share) {
  trajectory::ZigzagOptions options;
  // Where each joint sweeps in turn, there are postures enough with fewer steps.
  options.divisions = bounds.joints.size() == 3 ? 2 : 1;
  options.limits = bounds;
  options.pace = share;
  return trajectory::make_zigzag(options);
}

Trajectory holds(const JointLimits& bounds, Path path) {
  const VectorXd span = bounds.high_ji - bounds.low_ji;
  for (const double at : {0.1, 0.9}) {
    path.move(bounds.low_ji + at * span, kCalm);
    path.hold(180.0);
  }
  return std::move(path).taken();
}

Trajectory reversals(const JointLimits& bounds, Path path) {
  const VectorXd span = bounds.high_ji - bounds.low_ji;
  for (const double at : {0.2, 0.5, 0.8}) {
    path.move(bounds.low_ji + at * span, kCalm);
    for (const double width : {0.001, 0.005, 0.025, 0.12})
      for (int k = 0; k < 10; ++k)
        path.move(bounds.low_ji + (at + (k % 2 == 0 ? 0.5 : -0.5) * width) * span, kCalm);
  }
  return std::move(path).taken();
}

Trajectory one_by_one(const JointLimits& bounds, Path path) {
  const VectorXd middle = 0.5 * (bounds.low_ji + bounds.high_ji);
  for (Eigen::Index j = 0; j < middle.size(); ++j) {
    for (int k = 0; k < 4; ++k) {
      VectorXd to = middle;
      to[j] = (k % 2 == 0 ? bounds.high_ji : bounds.low_ji)[j];
      path.move(to, kUsual);
    }
    path.move(middle, kUsual);
  }
  return std::move(path).taken();
}

}  // namespace

core::Result<JointLimits> bounds_of(const std::vector<Explored>& explored,
                                    const physics::Plant& plant) {
  const auto count = static_cast<Eigen::Index>(plant.joints.size());
  JointLimits out{trajectory::joints_of(plant), VectorXd(count), VectorXd(count), VectorXd(count)};
  for (Eigen::Index j = 0; j < count; ++j) {
    const physics::Joint& joint = plant.joints[static_cast<std::size_t>(j)];
    const auto seen = std::find_if(explored.begin(), explored.end(),
                                   [&](const Explored& e) { return e.joint == joint.name; });
    if (seen == explored.end() || !(seen->position.second > seen->position.first) ||
        !(seen->fastest > 0.0))
      return core::data_error(fmt::format(
          "joint {} did not move in the diagnosed recordings, so that no range is known in which "
          "it may",
          joint.name));
    const physics::Limits& limits = joint.limits;
    out.low_ji[j] = std::max(seen->position.first, limits.low_ji.value_or(seen->position.first));
    out.high_ji[j] =
        std::min(seen->position.second, limits.high_ji.value_or(seen->position.second));
    out.fastest_ji[j] = std::min(seen->fastest, limits.speed_ji.value_or(seen->fastest));
    if (!(out.low_ji[j] < out.high_ji[j]))
      return core::data_error(fmt::format(
          "joint {} was recorded from {:.6g} to {:.6g}, beyond its [joint.limits] in {} ({:.6g} to "
          "{:.6g}): nothing is left in which it may move",
          joint.name, seen->position.first, seen->position.second, plant.source,
          limits.low_ji.value_or(-HUGE_VAL), limits.high_ji.value_or(HUGE_VAL)));
  }
  return out;
}

core::Result<Trajectory> motion_of(Exercise motion, const JointLimits& bounds) {
  Path path(bounds, 0.5 * (bounds.low_ji + bounds.high_ji));
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
      for (int k = 0; k < 20; ++k) path.move(k % 2 == 0 ? bounds.high_ji : bounds.low_ji, kCalm);
      return std::move(path).taken();
    case Exercise::kNone:
      break;
  }
  return core::Error{core::ErrorCode::kUsage, "this experiment has no motion of its own"};
}

}  // namespace ravencal::experiment
