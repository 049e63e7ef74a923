// SPDX-License-Identifier: Apache-2.0
#include "robot/motion_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "core/constants.hpp"
#include "core/joint_layout.hpp"

namespace ravencal::robot {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr std::size_t kHeaderLines = 1;  // of a trajectory's CSV

}  // namespace

MotionLimits authors_limits() {
  return {.low_ji = {15.0 * core::kRadPerDeg, 50.0 * core::kRadPerDeg, 0.32},
          .high_ji = {70.0 * core::kRadPerDeg, 115.0 * core::kRadPerDeg, 0.43},
          .max_speed_ji_per_s = {2.182 * core::kRadPerDeg, 3.0 * core::kRadPerDeg, 0.005},
          .max_increment_ji = {0.0025, 0.0025, 5e-5}};
}

std::string joint_text(Index joint, double value_ji) {
  return joint == 2 ? fmt::format("{:.4f} m", value_ji)
                    : fmt::format("{:.2f} deg", value_ji / core::kRadPerDeg);
}

core::Status check_positions(const trajectory::Trajectory& trajectory, const MotionLimits& limits,
                             const std::string& source) {
  for (std::size_t row = 0; row < trajectory.joints_ji.size(); ++row) {
    for (Index joint = 0; joint < 3; ++joint) {
      const double value = trajectory.joints_ji[row][joint];
      const bool low = value < limits.low_ji[joint];
      if (!low && value <= limits.high_ji[joint]) continue;
      return core::Error{
          core::ErrorCode::kData,
          fmt::format("{}:{}: {} at {} is {} its limit of {}; nothing was sent", source,
                      row + 1 + kHeaderLines, core::kSlotNames[static_cast<std::size_t>(joint)],
                      joint_text(joint, value), low ? "below" : "above",
                      joint_text(joint, low ? limits.low_ji[joint] : limits.high_ji[joint]))};
    }
  }
  return {};
}

trajectory::Trajectory slowed(const trajectory::Trajectory& trajectory,
                              const MotionLimits& limits) {
  trajectory::Trajectory result = trajectory;
  for (std::size_t i = 1; i < result.t_s.size(); ++i) {
    const Vector3d move = trajectory.joints_ji[i] - trajectory.joints_ji[i - 1];
    const double shortest_s = move.cwiseAbs().cwiseQuotient(limits.max_speed_ji_per_s).maxCoeff();
    result.t_s[i] =
        result.t_s[i - 1] + std::max(trajectory.t_s[i] - trajectory.t_s[i - 1], shortest_s);
  }
  return result;
}

}  // namespace ravencal::robot
