// SPDX-License-Identifier: Apache-2.0
#include "ros/run_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "core/catalogue.hpp"
#include "core/constants.hpp"

namespace ravencal::ros_io {
namespace {

using core::RavenField;
using Eigen::Vector3d;
using robot::Phase;
using robot::StopReason;

constexpr std::uint32_t kQueue = 10'000;  // 10 s of the controller: bursts are late, not lost
constexpr std::array<std::size_t, 4> kToolSlots = {4, 5, 6, 7};
// Below this, measured_js and ravenstate show the same joints.
constexpr double kSameJoints = 0.02;

Vector3d joints_of(const record::RavenStateMessage& state, RavenField field, bool other) {
  Vector3d joints;
  for (std::size_t j = 0; j < 3; ++j) {
    joints[static_cast<Eigen::Index>(j)] =
        state.values[core::catalogue_index(field, j, other)] * core::kRadPerDeg;
  }
  return joints;
}

/// After these the arm may be pushing or the wrong one: the robot is asked to set its brakes.
bool needs_brakes(StopReason reason) {
  switch (reason) {
    case StopReason::kTracking:
    case StopReason::kIgnored:
    case StopReason::kOtherArm:
    case StopReason::kOutside:
    case StopReason::kStale:
      return true;
    default:
      return false;
  }
}

}  // namespace

RunWatch::RunWatch(ros::NodeHandle& node, MasterWatch& watch, const robot::RunArguments& arguments)
    : arguments_(arguments), last_reading_(Clock::now()) {
  const auto hear =
      [&](const std::string& topic, const record::RosMessageType& type,
          void (RunWatch::*take)(std::span<const std::uint8_t>, const ReceivedType&)) {
        watch.add_subscription(topic, std::string(type.name));
        subscribers_.push_back(
            subscribe(node, topic, kQueue, [this, take](auto bytes, const ReceivedType& received) {
              (this->*take)(bytes, received);
            }));
      };
  hear("/ravenstate", record::raven_state_type(), &RunWatch::take_state);
  hear("/operating_state", operating_state_type(), &RunWatch::take_operating_state);
  if (!arguments_.no_encoders)
    hear("/ext_jpos", record::joint_state_type(), &RunWatch::take_reading);
  if (arguments_.looks_only()) {
    for (const char* topic : {"/arm1/measured_js", "/arm2/measured_js"}) {
      watch.add_subscription(topic, std::string(record::joint_state_type().name));
      subscribers_.push_back(
          subscribe(node, topic, kQueue, [this, topic](auto bytes, const ReceivedType& received) {
            take_measured(topic, bytes, received);
          }));
    }
    return;
  }
  const auto speak = [&](const std::string& topic, const record::RosMessageType& type) {
    watch.add_publication(topic, std::string(type.name));
    return advertise(node, topic, type, kQueue);
  };
  for (const robot::CrtkArm arm : arguments_.crtk_arms()) {
    const auto i = static_cast<std::size_t>(arm);
    increments_[i] = speak(robot::command_topic_of(arm, "jr"), record::joint_state_type());
    if (arguments_.mode == "jp")
      positions_[i] = speak(robot::command_topic_of(arm, "jp"), record::joint_state_type());
  }
  state_command_ = speak("/state_command", string_stamped_type());
}

double RunWatch::since_s(Clock::time_point then) const {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

bool RunWatch::refuse(const std::string& topic, const ReceivedType& type,
                      const record::RosMessageType& expected) {
  std::string mismatch = type_mismatch(topic, type, expected);
  if (mismatch.empty()) return false;
  heard_.refused = std::move(mismatch);
  if (follower_) follower_->stop(StopReason::kStale, heard_.refused);
  return true;
}

void RunWatch::take_state(std::span<const std::uint8_t> bytes, const ReceivedType& type) {
  const std::lock_guard lock(mutex_);
  if (refuse("/ravenstate", type, record::raven_state_type())) return;
  const auto state = record::decode_raven_state(bytes, arguments_.arm == "gold");
  if (!state) return;
  last_state_ = Clock::now();
  if (heard_.states++ == 0) first_stamp_ns_ = state->stamp_ns;
  const double span_s = 1e-9 * static_cast<double>(state->stamp_ns - first_stamp_ns_);
  if (span_s > 0.0) heard_.state_rate_hz = static_cast<double>(heard_.states - 1) / span_s;
  heard_.runlevel =
      static_cast<std::int32_t>(state->values[core::catalogue_index(RavenField::kRunlevel, 0)]);
  joints_ji_ = joints_of(*state, RavenField::kJpos, false);
  if (!follower_) return;
  newest_ = *state;
  fresh_.notify_one();
  const Phase phase = follower_->phase();
  if (phase != Phase::kWaiting && !recording_error_)
    note_failure(recorder_->take(*state, phase == Phase::kMoving));
}

void RunWatch::take_operating_state(std::span<const std::uint8_t> bytes, const ReceivedType& type) {
  const std::lock_guard lock(mutex_);
  if (refuse("/operating_state", type, operating_state_type())) return;
  const auto message = decode_operating_state(bytes);
  if (!message) return;
  last_operating_ = Clock::now();
  ++heard_.operating_states;
  heard_.operating = robot::operating_state_from(message->state);
  heard_.homed = message->is_homed;
}

void RunWatch::take_reading(std::span<const std::uint8_t> bytes, const ReceivedType& type) {
  const std::lock_guard lock(mutex_);
  if (refuse("/ext_jpos", type, record::joint_state_type())) return;
  const auto message = record::decode_joint_state(bytes);
  if (!message || message->positions.size() != 3) return;
  last_reading_ = Clock::now();
  ++heard_.readings;
  if (!recorder_) return;
  recorder_->take_truth(message->stamp_ns,
                        {message->positions[0], message->positions[1], message->positions[2]});
}

void RunWatch::take_measured(const char* topic, std::span<const std::uint8_t> bytes,
                             const ReceivedType& type) {
  const std::lock_guard lock(mutex_);
  if (type.md5 != record::joint_state_type().md5 || heard_.states == 0) return;
  const auto message = record::decode_joint_state(bytes);
  if (!message || message->positions.size() < 3) return;
  const Vector3d measured(message->positions[0], message->positions[1], message->positions[2]);
  if ((measured - joints_ji_).cwiseAbs().maxCoeff() < kSameJoints) heard_.measured_js = topic;
}

robot::RobotView RunWatch::view_of(const record::RavenStateMessage& state) const {
  const auto seen =
      std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch());
  return {.stamp_ns = state.stamp_ns,
          .seen_ns = seen.count(),
          .runlevel = heard_.runlevel,
          .operating = heard_.operating,
          .homed = heard_.homed,
          .joints_ji = joints_of(state, RavenField::kJpos, false),
          .desired_ji = joints_of(state, RavenField::kJposD, false),
          .other_joints_ji = joints_of(state, RavenField::kJpos, true),
          .other_desired_ji = joints_of(state, RavenField::kJposD, true)};
}

void RunWatch::drive(std::chrono::milliseconds longest_wait) {
  std::unique_lock lock(mutex_);
  fresh_.wait_for(lock, longest_wait, [this] { return newest_.has_value(); });
  if (!follower_) return;
  follower_->note_silence(since_s(std::min(last_state_, last_operating_)));
  if (!newest_) return;
  follow(*newest_);
  newest_.reset();
}

void RunWatch::follow(const record::RavenStateMessage& state) {
  const Phase before = follower_->phase();
  if (const auto command = follower_->take(view_of(state))) send(*command, state);
  note_phase(before, state.stamp_ns);
}

void RunWatch::send(const robot::Command& command, const record::RavenStateMessage& state) {
  const bool relative = command.probes || arguments_.mode == "jr";
  const Vector3d& joints = relative ? command.increment_ji : command.setpoint_ji;
  record::JointStateMessage message;
  message.stamp_ns = state.stamp_ns;
  message.names = {"shoulder", "elbow", "insertion", "roll", "wrist", "grasp1", "grasp2"};
  message.positions.assign(joints.data(), joints.data() + 3);
  // The tool stays as it is.
  for (const std::size_t slot : kToolSlots) {
    message.positions.push_back(
        relative
            ? 0.0
            : state.values[core::catalogue_index(RavenField::kJposD, slot)] * core::kRadPerDeg);
  }
  const auto arm = static_cast<std::size_t>(command.arm);
  publish(relative ? increments_[arm] : positions_[arm], record::joint_state_type(),
          record::encode_joint_state(message));
}

void RunWatch::note_phase(Phase before, std::int64_t stamp_ns) {
  const Phase now = follower_->phase();
  if (now == before || recording_error_) return;
  const std::string at = fmt::format("{{\"progress\":{:.4f}}}", follower_->progress());
  if (now == Phase::kProbing) {
    note_failure(recorder_->note(stamp_ns, "probe", "begins: an elbow moves by 0.3 deg and back"));
  } else if (before == Phase::kProbing && follower_->crtk_arm()) {
    note_failure(recorder_->note(
        stamp_ns, "probe",
        fmt::format("{} drives the {} arm",
                    robot::command_topic_of(*follower_->crtk_arm(), arguments_.mode),
                    arguments_.arm)));
  }
  if (now == Phase::kPaused) note_failure(recorder_->note(stamp_ns, "pause", at));
  if (now == Phase::kMoving) {
    const bool resumed = before == Phase::kPaused;
    note_failure(recorder_->note(stamp_ns, resumed ? "resume" : "start", at));
    // Features with memory begin afresh: no rows were recorded meanwhile.
    if (resumed) note_failure(recorder_->note(stamp_ns, "episode", "after a pause"));
  }
  if (now == Phase::kDone) note_failure(recorder_->note(stamp_ns, "end", at));
}

void RunWatch::note_failure(const core::Status& status) {
  if (status.ok() || recording_error_) return;
  recording_error_ = status.error();
  follower_->stop(StopReason::kRecording,
                  "the recording cannot be written: " + status.error().message);
}

void RunWatch::begin(robot::Follower follower, robot::RunRecorder recorder) {
  const std::lock_guard lock(mutex_);
  recorder_.emplace(std::move(recorder));
  follower_.emplace(std::move(follower));
}

void RunWatch::stop(StopReason reason, const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (follower_) follower_->stop(reason, text);
}

core::Status RunWatch::finish() {
  const std::lock_guard lock(mutex_);
  if (!follower_) return {};
  const robot::Stop& stop = follower_->stopped();
  if (follower_->phase() == Phase::kStopped && needs_brakes(stop.reason))
    publish(state_command_, string_stamped_type(), encode_string_stamped({0, "pause"}));
  if (recording_error_) return *recording_error_;
  if (follower_->phase() == Phase::kStopped) note_failure(recorder_->note(0, "stop", stop.text));
  const core::Status closed = recorder_->finish();
  return recording_error_ ? core::Status(*recording_error_) : closed;
}

Heard RunWatch::heard() const {
  const std::lock_guard lock(mutex_);
  Heard heard = heard_;
  heard.silent_s = since_s(std::min(last_state_, last_operating_));
  heard.readings_silent_s = since_s(last_reading_);
  return heard;
}

Standing RunWatch::standing() const {
  const std::lock_guard lock(mutex_);
  Standing standing;
  if (!follower_) return standing;
  standing.phase = follower_->phase();
  standing.stop = follower_->stopped();
  standing.waiting_for = follower_->waiting_for();
  standing.progress = follower_->progress();
  standing.left_s = follower_->left_s();
  standing.pauses = follower_->pauses();
  standing.rows = recorder_->rows();
  standing.rows_with_truth = recorder_->rows_with_truth();
  standing.recording_error = recording_error_;
  return standing;
}

}  // namespace ravencal::ros_io
