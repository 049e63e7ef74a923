// SPDX-License-Identifier: Apache-2.0
//
// Watches the arm that is not commanded. It may creep: whenever no joint command came for ten
// cycles, the CRTK branch sets the desired joints of both arms to the measured ones (rt_raven.cpp,
// joint_ctrl_countdown), so the servo no longer holds it against friction and weight. It must not
// follow the commands.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace ravencal::robot {

class IdleArm {
 public:
  /// Motion within a minute that is no creep: 0.5 deg, 0.5 deg, 1 mm. Under the real controller an
  /// idle arm crept by 0.5 deg in 57 % of five zig-zags, some 14 minutes; an arm that is led, at
  /// degrees per second, passes this within a second.
  static const Eigen::Vector3d& largest_in_a_minute_ji();
  /// Creep since the start that is too much all the same: 5 deg, 5 deg, 10 mm.
  static const Eigen::Vector3d& largest_ji();

  /// Begins to watch; after a pause again, from where the arm is then.
  void start(std::int64_t t_ns, const Eigen::Vector3d& joints_ji);

  struct Motion {
    Eigen::Index joint = 0;
    double moved_ji = 0.0;
    double within_s = 0.0;
  };
  /// The first joint that moved too far, if any.
  std::optional<Motion> take(std::int64_t t_ns, const Eigen::Vector3d& joints_ji);

 private:
  std::int64_t start_ns_ = 0;
  std::int64_t minute_ns_ = 0;
  Eigen::Vector3d start_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d minute_ji_ = Eigen::Vector3d::Zero();
};

}  // namespace ravencal::robot
