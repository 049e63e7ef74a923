// SPDX-License-Identifier: Apache-2.0
//
// Leads the arm along a trajectory by joint commands, closed over the robot's own joint estimate,
// and decides when to wait, to go on and to stop. Driven by the robot's states and the times that
// they carry: no clock, no ROS, same states, same commands. One thread. Joints 1 to 3: rad, rad, m.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "core/run_level.hpp"
#include "robot/arm_probe.hpp"
#include "robot/idle_arm.hpp"
#include "robot/joint_commands.hpp"
#include "robot/motion_limits.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::robot {

/// Of crtk_msgs/operating_state.
enum class OperatingState { kUnknown, kDisabled, kEnabled, kPaused, kFault };
OperatingState operating_state_from(const std::string& name);
const char* name_of(OperatingState state);

using enum core::RunLevel;

/// What the robot said last.
struct RobotView {
  std::int64_t stamp_ns = 0;  ///< by the robot's clock
  std::int64_t seen_ns = 0;   ///< by the caller's monotonic clock: after a hold-up, much at once
  std::int32_t runlevel = kEmergencyStop;
  OperatingState operating = OperatingState::kUnknown;
  bool homed = false;
  Eigen::Vector3d joints_ji = Eigen::Vector3d::Zero();
  Eigen::Vector3d desired_ji = Eigen::Vector3d::Zero();
  Eigen::Vector3d other_joints_ji = Eigen::Vector3d::Zero();
  Eigen::Vector3d other_desired_ji = Eigen::Vector3d::Zero();
};

/// One message for the robot, in both forms; the caller sends the one that it speaks, of a probe
/// always the increment.
struct Command {
  CrtkArm arm = CrtkArm::kArm1;
  bool probes = false;
  Eigen::Vector3d increment_ji;  ///< servo_jr: within the increments of MotionLimits
  Eigen::Vector3d setpoint_ji;   ///< servo_jp: where these increments have led
};

enum class Phase {
  kWaiting,  ///< has not moved yet: waits for a homed robot with the pedal down
  kProbing,  ///< moves an elbow a little to learn which CRTK arm drives the calibrated arm
  kMoving,
  kPaused,  ///< the pedal is up
  kDone,
  kStopped,  ///< for good; stop() says why
};

enum class StopReason {
  kNone,
  kEmergencyStop,
  kNotHomed,   ///< the robot began to initialise again
  kStale,      ///< no state for too long, or its stamps ran back
  kTracking,   ///< the arm is not where the controller wants it
  kIgnored,    ///< the controller does not take the commands
  kOtherArm,   ///< the arm that is not commanded moves
  kOutside,    ///< the arm is outside its limits
  kReplaced,   ///< another node took this one's name
  kRecording,  ///< the recording cannot be written
  kUser,
};

struct Stop {
  StopReason reason = StopReason::kNone;
  std::string text;
};

struct FollowerOptions {
  MotionLimits limits = authors_limits();
  std::string arm = "gold";
  std::optional<CrtkArm> crtk_arm;  ///< drives that arm; nothing: a probe finds it out
  std::string mode = "jr";          ///< for messages
  double stale_s = 0.2;             ///< without a state for so long: stop
  /// Largest distance between the controller's desired joints and its measured ones.
  Eigen::Vector3d tracking_ji{0.035, 0.035, 0.004};  // 2 deg, 2 deg, 4 mm
};

/// "/arm1/servo_jr"; `mode` is "jr" or "jp".
std::string command_topic_of(CrtkArm arm, const std::string& mode);

class Follower {
 public:
  /// `trajectory` is within the positions of the limits; it is slowed to their speeds.
  Follower(const trajectory::Trajectory& trajectory, const FollowerOptions& options);

  /// Takes the next state; returns what to send, if anything.
  std::optional<Command> take(const RobotView& view);
  /// Nothing has come for so long, by the caller's clock.
  void note_silence(double silent_s);
  /// Stops for good, unless it has ended already.
  void stop(StopReason reason, std::string text);

  [[nodiscard]] Phase phase() const { return phase_; }
  [[nodiscard]] const Stop& stopped() const { return stop_; }
  /// What the robot has to do before it can move; empty if nothing.
  [[nodiscard]] const std::string& waiting_for() const { return waiting_for_; }
  /// Share of the trajectory that lies behind.
  [[nodiscard]] double progress() const;
  /// Time left at full speed.
  [[nodiscard]] double left_s() const { return path_.duration_s() - along_s_; }
  [[nodiscard]] double duration_s() const { return path_.duration_s(); }
  [[nodiscard]] int pauses() const { return pauses_; }
  /// The CRTK arm that drives the calibrated arm, once it is known.
  [[nodiscard]] std::optional<CrtkArm> crtk_arm() const { return options_.crtk_arm; }

 private:
  bool check_time(const RobotView& view);
  bool check_run_state(const RobotView& view);
  bool check_motion(const RobotView& view);
  void note_taken(const RobotView& view);
  void check_commands_are_taken(const RobotView& view);
  void open_window(const RobotView& view);
  void begin_moving(const RobotView& view);
  std::optional<Command> probe(const RobotView& view, double dt_s);
  bool check_other_arm(const RobotView& view);
  [[nodiscard]] std::string command_topic() const;
  Command step(const RobotView& view, double dt_s);

  trajectory::Trajectory path_;
  FollowerOptions options_;
  Phase phase_ = Phase::kWaiting;
  Stop stop_;
  std::string waiting_for_ = "the robot's state";
  double along_s_ = 0.0;  // place on path_
  int pauses_ = 0;
  std::optional<std::int64_t> last_stamp_ns_;
  std::int64_t last_command_ns_ = 0;
  std::int64_t last_command_seen_ns_ = 0;
  std::int64_t tracked_ns_ = 0;  // when the arm was last close to its desired joints
  std::int64_t near_end_since_ns_ = 0;
  Eigen::Vector3d setpoint_ji_ = Eigen::Vector3d::Zero();
  ArmProbe probe_;
  IdleArm idle_arm_;
  Eigen::Vector3d own_start_ji_ = Eigen::Vector3d::Zero();
  // Window in which the controller's desired joints are compared with the commands.
  std::int64_t window_ns_ = 0;
  std::int64_t window_seen_ns_ = 0;
  Eigen::Vector3d window_commanded_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d window_taken_ji_ = Eigen::Vector3d::Zero();  // both without sign
  Eigen::Vector3d last_desired_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_increment_ji_ = Eigen::Vector3d::Zero();
};

}  // namespace ravencal::robot
