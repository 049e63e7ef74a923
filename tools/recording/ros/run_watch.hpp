// SPDX-License-Identifier: Apache-2.0
//
// The robot as `ravencal run` sees it: takes states, operating states and encoder readings as they
// come and records them, in ROS's spinner thread; drives the follower and sends its commands, in
// the caller's. The follower gets the newest state only: after a hold-up there is one command, not
// a burst of old ones, which the controller would add up.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "robot/run_plan.hpp"
#include "robot/run_recorder.hpp"
#include "ros/master_watch.hpp"
#include "ros/messages.hpp"
#include "ros/raw_topics.hpp"

namespace ravencal::ros_io {

/// What has been heard, for checks and messages.
struct Heard {
  std::int64_t states = 0;
  std::int64_t operating_states = 0;
  std::int64_t readings = 0;
  double silent_s = 0.0;           ///< since the last state and operating state, the older of both
  double readings_silent_s = 0.0;  ///< since the last reading; since the start if there was none
  double state_rate_hz = 0.0;      ///< by the states' own stamps
  std::int32_t runlevel = robot::kEmergencyStop;
  robot::OperatingState operating = robot::OperatingState::kUnknown;
  bool homed = false;
  std::string measured_js;  ///< the topic that shows the arm's joints, "/arm2/measured_js"
  std::string refused;      ///< why messages are not taken: another revision; empty if taken
};

/// Where the follower is.
struct Standing {
  robot::Phase phase = robot::Phase::kWaiting;
  robot::Stop stop;
  std::string waiting_for;
  double progress = 0.0;
  double left_s = 0.0;
  int pauses = 0;
  std::int64_t rows = 0;
  std::int64_t rows_with_truth = 0;
  std::optional<core::Error> recording_error;
};

class RunWatch {
 public:
  RunWatch(ros::NodeHandle& node, MasterWatch& watch, const robot::RunArguments& arguments);

  /// From now on there is a follower to drive. Once.
  void begin(robot::Follower follower, robot::RunRecorder recorder);
  /// Ends the motion, asks the robot to pause where that is safer, and closes the recording.
  core::Status finish();
  /// Stops the follower.
  void stop(robot::StopReason reason, const std::string& text);
  /// Waits for the next state, so long at most, and drives the follower with the newest; tells it
  /// how long nothing has come.
  void drive(std::chrono::milliseconds longest_wait);

  [[nodiscard]] Heard heard() const;
  [[nodiscard]] Standing standing() const;

 private:
  using Clock = std::chrono::steady_clock;
  void take_state(std::span<const std::uint8_t> bytes, const ReceivedType& type);
  void take_operating_state(std::span<const std::uint8_t> bytes, const ReceivedType& type);
  void take_reading(std::span<const std::uint8_t> bytes, const ReceivedType& type);
  void take_measured(const char* topic, std::span<const std::uint8_t> bytes,
                     const ReceivedType& type);
  bool refuse(const std::string& topic, const ReceivedType& type,
              const record::RosMessageType& expected);
  robot::RobotView view_of(const record::RavenStateMessage& state) const;
  void follow(const record::RavenStateMessage& state);
  void send(const robot::Command& command, const record::RavenStateMessage& state);
  void note_phase(robot::Phase before, std::int64_t stamp_ns);
  void note_failure(const core::Status& status);
  double since_s(Clock::time_point then) const;

  const robot::RunArguments arguments_;
  mutable std::mutex mutex_;  // guards everything below
  std::condition_variable fresh_;
  std::optional<record::RavenStateMessage> newest_;  // not yet shown to the follower
  Heard heard_;
  Clock::time_point last_state_;
  Clock::time_point last_operating_;
  Clock::time_point last_reading_;
  std::int64_t first_stamp_ns_ = 0;
  Eigen::Vector3d joints_ji_ = Eigen::Vector3d::Zero();  // of the last state, for take_measured
  std::optional<robot::Follower> follower_;
  std::optional<robot::RunRecorder> recorder_;
  std::optional<core::Error> recording_error_;
  std::array<ros::Publisher, 2> increments_;  ///< servo_jr by CRTK arm, for those that may be sent
  std::array<ros::Publisher, 2> positions_;   ///< servo_jp likewise
  ros::Publisher state_command_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace ravencal::ros_io
