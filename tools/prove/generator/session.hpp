// SPDX-License-Identifier: Apache-2.0
//
// One recorded run of a sealed case: the robot in its 1 kHz loop (quantised encoders, velocity as a
// raw difference, whole DAC counts, clipping), noise that remembers, and the recorder's chain
// (throttled robot stream, truth stamped late on another clock, nearest stamps paired).
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/result.hpp"
#include "prove/generator/mechanics.hpp"
#include "prove/generator/motion.hpp"
#include "record/recording.hpp"

namespace ravencal::prove {

using AddedOverTime = std::vector<std::function<double(double t_s)>>;

/// The controller of one joint as it really is, and what its recorder adds. Torques of `kp`, `kd`
/// at the capstan per motor rad; noise in joint units.
struct JointSession {
  double kp = 0.0, kd = 0.0;
  double dac_counts_per_n_m = 1.0;
  double dac_limit_counts = 0.0;
  double motor_counts_per_rev = 4000.0;
  double truth_resolution = 0.0;
  double truth_offset = 0.0;
  double white = 0.0, coloured = 0.0, walk_per_root_s = 0.0;  ///< of the truth
  double disturbance = 0.0;      ///< of the motor's effort: deviation of coloured noise
  double friction_wander = 0.0;  ///< relative deviation of the dry friction's level
  std::vector<std::pair<double, long>> lost_counts;  ///< time, counts of the motor encoder
  /// What hidden effects add over time: to the motor's effort, to its dry friction in relation to
  /// the level, to the length of the cable, and to the effort asked of the drive, which is
  /// recorded.
  AddedOverTime added_effort, added_friction, added_length, added_input;
  std::vector<std::function<double(double t_s, const Vector3d& joints)>> added_truth;
  double truth_delay_s = 0.0;  ///< of this joint's truth, beyond the recorder's latency
  MotionRange range;
};

/// What the session description leaves to the laws of the other world (other/laws.hpp): Dahl's
/// exponents per joint, and a servo of cascaded loops. The own world does not read it.
struct OtherLaws {
  std::array<double, 3> motor_exponent = {1.0, 1.0, 1.0}, joint_exponent = {1.0, 1.0, 1.0};
  double integral_time_s = 0.0;  ///< of the velocity loop; 0: it has no integral
  double velocity_filter_s = 0.002;
  int latency_cycles = 1;  ///< between reading and drive
  double current_lag_s = 5e-4;
};

struct Session {
  RobotPhysics robot;
  Eigen::Matrix3d believed_coupling = Eigen::Matrix3d::Zero();  ///< the controller's
  std::vector<JointSession> joints;
  MotionKind motion = MotionKind::kSlow;
  double duration_s = 240.0;
  double planned_s = 0.0;  ///< length that the motion is for, where the recording is cut short
  int cycles_per_row = 10;
  double homed_at_s = 0.0;  ///< homed again: rest, an event and 2 s without rows; 0: never
  double truth_period_s = 0.0104, truth_latency_s = 0.004, truth_latency_deviation_s = 0.0015;
  double truth_clock_error = 0.0;  ///< relative
  double lost_truth = 0.0;         ///< share of rows without truth
  bool with_truth = true;
  bool with_torque = true;
  OtherLaws other;
  bool with_noise = true;  ///< false: sensors and friction are quiet (for closed-form checks)
};

/// Seeds: motion and noise are drawn apart, so that twins can share one and differ in the other.
struct SessionSeeds {
  std::uint64_t motion = 1;
  std::uint64_t noise = 1;
};

/// Records the session. `look` is asked about once per simulated second; false stops (kUsage).
core::Result<record::Recording> run_session(const Session& session, const SessionSeeds& seeds,
                                            const std::function<bool()>& look);

}  // namespace ravencal::prove
