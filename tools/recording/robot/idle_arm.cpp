// SPDX-License-Identifier: Apache-2.0
#include "robot/idle_arm.hpp"

#include <cmath>

namespace ravencal::robot {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kMinuteNs = 60'000'000'000;

}  // namespace

const Vector3d& IdleArm::largest_in_a_minute_ji() {
  static const Vector3d largest(0.0087, 0.0087, 0.001);
  return largest;
}

const Vector3d& IdleArm::largest_ji() {
  static const Vector3d largest(0.087, 0.087, 0.01);
  return largest;
}

void IdleArm::start(std::int64_t t_ns, const Vector3d& joints_ji) {
  start_ns_ = minute_ns_ = t_ns;
  start_ji_ = minute_ji_ = joints_ji;
}

std::optional<IdleArm::Motion> IdleArm::take(std::int64_t t_ns, const Vector3d& joints_ji) {
  const auto beyond = [&](const Vector3d& from_ji, std::int64_t from_ns,
                          const Vector3d& largest_ji) -> std::optional<Motion> {
    for (Eigen::Index joint = 0; joint < 3; ++joint) {
      const double moved = std::abs(joints_ji[joint] - from_ji[joint]);
      if (moved <= largest_ji[joint]) continue;
      return Motion{joint, moved, 1e-9 * static_cast<double>(t_ns - from_ns)};
    }
    return std::nullopt;
  };
  if (auto led = beyond(minute_ji_, minute_ns_, largest_in_a_minute_ji())) return led;
  if (t_ns - minute_ns_ >= kMinuteNs) {
    minute_ns_ = t_ns;
    minute_ji_ = joints_ji;
  }
  return beyond(start_ji_, start_ns_, largest_ji());
}

}  // namespace ravencal::robot
