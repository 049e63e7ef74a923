// SPDX-License-Identifier: Apache-2.0
#include "robot/follower.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/joint_layout.hpp"

namespace ravencal::robot {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kGainPerS = 2.0;                     // of the authors' follower
constexpr std::int64_t kCommandPeriodNs = 2'000'000;  // the authors send at most 500 per second
// By the caller's clock, which jitters: states that were held up come at once, and commands for all
// of them would add up to a jump.
constexpr std::int64_t kShortestSeenNs = kCommandPeriodNs / 2;
constexpr double kLongestStepS = 0.02;                 // after a hole in the states: no jump
constexpr std::int64_t kTrackingTimeNs = 200'000'000;  // so long away from the desired joints
constexpr std::int64_t kWindowNs = 3'000'000'000;      // in which commands must have shown
constexpr std::int64_t kSettleNs = 2'000'000'000;      // at the end, even if friction keeps it off
constexpr double kTakenShare = 0.2;                    // of the commands in a window
// Or in twice that, by both clocks: a network may stand still.
constexpr std::int64_t kPatienceNs = 6'000'000'000;
// Lag at which the place on the path stands still, and what still counts as arrived.
const Vector3d kLongestLag{0.0175, 0.0175, 0.002};   // 1 deg, 1 deg, 2 mm
const Vector3d kArrived{0.0017, 0.0017, 2e-4};       // 0.1 deg, 0.1 deg, 0.2 mm
const Vector3d kOwnMoves{0.0087, 0.0087, 0.001};     // 0.5 deg, 0.5 deg, 1 mm: it is led
const Vector3d kCommandSeen{0.0087, 0.0087, 0.001};  // less than this proves nothing
const Vector3d kOutsideMargin{0.07, 0.07, 0.01};     // 4 deg, 4 deg, 10 mm

Vector3d clipped(const Vector3d& value, const Vector3d& largest) {
  return value.cwiseMin(largest).cwiseMax(-largest);
}

/// First joint whose value is beyond its bound, if any.
std::optional<Index> beyond(const Vector3d& value, const Vector3d& bound) {
  for (Index joint = 0; joint < 3; ++joint) {
    if (!(std::abs(value[joint]) <= bound[joint])) return joint;
  }
  return std::nullopt;
}

std::string_view name_of_joint(Index joint) {
  return core::kSlotNames[static_cast<std::size_t>(joint)];
}

constexpr std::array<std::pair<const char*, OperatingState>, 4> kOperatingStates = {{
    {"DISABLED", OperatingState::kDisabled},
    {"ENABLED", OperatingState::kEnabled},
    {"PAUSED", OperatingState::kPaused},
    {"FAULT", OperatingState::kFault},
}};

}  // namespace

OperatingState operating_state_from(const std::string& name) {
  for (const auto& [text, state] : kOperatingStates) {
    if (name == text) return state;
  }
  return OperatingState::kUnknown;
}

const char* name_of(OperatingState state) {
  for (const auto& [text, each] : kOperatingStates) {
    if (state == each) return text;
  }
  return "unknown";
}

Follower::Follower(const trajectory::Trajectory& trajectory, const FollowerOptions& options)
    : path_(slowed(trajectory, options.limits)), options_(options), probe_(options.limits) {}

std::string command_topic_of(CrtkArm arm, const std::string& mode) {
  return fmt::format("/arm{}/servo_{}", arm == CrtkArm::kArm1 ? 1 : 2, mode);
}

std::string Follower::command_topic() const {
  return command_topic_of(options_.crtk_arm.value_or(CrtkArm::kArm1), options_.mode);
}

double Follower::progress() const {
  if (phase_ == Phase::kDone) return 1.0;
  return path_.duration_s() > 0.0 ? along_s_ / path_.duration_s() : 0.0;
}

void Follower::stop(StopReason reason, std::string text) {
  if (phase_ == Phase::kDone || phase_ == Phase::kStopped) return;
  phase_ = Phase::kStopped;
  stop_ = {reason, std::move(text)};
}

void Follower::note_silence(double silent_s) {
  if (phase_ == Phase::kWaiting || silent_s <= options_.stale_s) return;
  stop(StopReason::kStale,
       fmt::format("no state from the robot for {:.2f} s (limit {:.2f} s): is the control process "
                   "alive?",
                   silent_s, options_.stale_s));
}

std::optional<Command> Follower::take(const RobotView& view) {
  if (phase_ == Phase::kDone || phase_ == Phase::kStopped) return std::nullopt;
  if (!check_time(view) || !check_run_state(view) || !check_motion(view)) return std::nullopt;
  const std::int64_t since_ns = view.stamp_ns - last_command_ns_;
  const std::int64_t seen_since_ns = view.seen_ns - last_command_seen_ns_;
  if (since_ns < kCommandPeriodNs || seen_since_ns < kShortestSeenNs) return std::nullopt;
  last_command_ns_ = view.stamp_ns;
  last_command_seen_ns_ = view.seen_ns;
  const double dt_s = std::min(1e-9 * static_cast<double>(since_ns), kLongestStepS);
  if (phase_ == Phase::kProbing) return probe(view, dt_s);
  return step(view, dt_s);
}

std::optional<Command> Follower::probe(const RobotView& view, double dt_s) {
  const CrtkArm tried = probe_.arm();
  const auto increment = probe_.step(view, dt_s);
  if (probe_.found()) {
    options_.crtk_arm = probe_.arm();
    begin_moving(view);
    return std::nullopt;
  }
  if (!probe_.failure().empty()) {
    stop(StopReason::kIgnored,
         fmt::format("cannot tell which CRTK arm is the {} arm: {}; give --crtk-arm", options_.arm,
                     probe_.failure()));
    return std::nullopt;
  }
  if (!increment) return std::nullopt;
  return Command{tried, true, *increment, view.desired_ji};
}

/// False if this state came at a time at which nothing may be sent.
bool Follower::check_time(const RobotView& view) {
  const std::int64_t before_ns = last_stamp_ns_.value_or(view.stamp_ns);
  last_stamp_ns_ = view.stamp_ns;
  if (phase_ == Phase::kWaiting) return true;
  if (view.stamp_ns < before_ns) {
    stop(StopReason::kStale,
         fmt::format("the robot's stamps ran back by {:.3f} s: its clock was set",
                     1e-9 * static_cast<double>(before_ns - view.stamp_ns)));
    return false;
  }
  note_silence(1e-9 * static_cast<double>(view.stamp_ns - before_ns));
  return phase_ != Phase::kStopped;
}

/// True if the robot may be moved now; starts, pauses, goes on and stops.
bool Follower::check_run_state(const RobotView& view) {
  const bool unable =
      view.operating == OperatingState::kDisabled || view.operating == OperatingState::kFault;
  if (phase_ != Phase::kWaiting && (view.runlevel == kEmergencyStop || unable)) {
    stop(StopReason::kEmergencyStop, fmt::format("E-stop: run level {}, operating state {}",
                                                 view.runlevel, name_of(view.operating)));
    return false;
  }
  if (phase_ != Phase::kWaiting && (view.runlevel == kInit || !view.homed)) {
    stop(StopReason::kNotHomed,
         "the robot initialises again: its encoder offsets change, so a "
         "recording cannot go on");
    return false;
  }
  if (view.homed && view.runlevel == kPedalDown && view.operating == OperatingState::kEnabled) {
    if (!options_.crtk_arm && phase_ != Phase::kProbing) {
      phase_ = Phase::kProbing;
      waiting_for_.clear();
      probe_.restart();
      tracked_ns_ = last_command_ns_ = view.stamp_ns;
      last_command_seen_ns_ = view.seen_ns;
    } else if (phase_ != Phase::kMoving && phase_ != Phase::kProbing) {
      begin_moving(view);
    }
    return true;
  }
  if (phase_ == Phase::kProbing) phase_ = Phase::kWaiting;
  if (phase_ == Phase::kMoving) {
    phase_ = Phase::kPaused;
    ++pauses_;
  }
  waiting_for_ = view.runlevel == kEmergencyStop ? "the E-stop to be released and the silver button"
                 : view.homed                    ? "the pedal"
                                                 : "the robot to be homed";
  return false;
}

void Follower::begin_moving(const RobotView& view) {
  phase_ = Phase::kMoving;
  waiting_for_.clear();
  // The controller has set its desired joints to the measured ones.
  setpoint_ji_ = view.joints_ji;
  idle_arm_.start(view.stamp_ns, view.other_joints_ji);
  own_start_ji_ = view.joints_ji;
  last_command_ns_ = view.stamp_ns;
  last_command_seen_ns_ = view.seen_ns;
  tracked_ns_ = view.stamp_ns;
  near_end_since_ns_ = 0;
  open_window(view);
}

bool Follower::check_other_arm(const RobotView& view) {
  const auto moved = idle_arm_.take(view.stamp_ns, view.other_joints_ji);
  if (!moved) return true;
  const bool own_moved = beyond(view.joints_ji - own_start_ji_, kOwnMoves).has_value();
  stop(StopReason::kOtherArm,
       fmt::format("the {} of the other arm moved by {} within {:.1f} s while {} was commanded{}",
                   name_of_joint(moved->joint), joint_text(moved->joint, moved->moved_ji),
                   moved->within_s, command_topic(),
                   own_moved ? "; only the calibrated arm may move"
                             : fmt::format(" and the {} arm did not: these topics drive the other "
                                           "arm; leave --crtk-arm away, or give the other one",
                                           options_.arm)));
  return false;
}

bool Follower::check_motion(const RobotView& view) {
  if (!view.joints_ji.allFinite() || !view.desired_ji.allFinite()) {
    stop(StopReason::kStale, "the robot's joints are not numbers");
    return false;
  }
  if (phase_ == Phase::kMoving && !check_other_arm(view)) return false;
  const Vector3d below = options_.limits.low_ji - kOutsideMargin - view.joints_ji;
  const Vector3d above = view.joints_ji - options_.limits.high_ji - kOutsideMargin;
  for (Index joint = 0; joint < 3; ++joint) {
    if (std::max(below[joint], above[joint]) <= 0.0) continue;
    stop(StopReason::kOutside,
         fmt::format("{} is at {}, far outside {} to {}", name_of_joint(joint),
                     joint_text(joint, view.joints_ji[joint]),
                     joint_text(joint, options_.limits.low_ji[joint]),
                     joint_text(joint, options_.limits.high_ji[joint])));
    return false;
  }
  const auto apart = beyond(view.desired_ji - view.joints_ji, options_.tracking_ji);
  if (!apart) tracked_ns_ = view.stamp_ns;
  if (apart && view.stamp_ns - tracked_ns_ > kTrackingTimeNs) {
    stop(StopReason::kTracking,
         fmt::format("tracking error: {} is at {}, the controller wants it at {}",
                     name_of_joint(*apart), joint_text(*apart, view.joints_ji[*apart]),
                     joint_text(*apart, view.desired_ji[*apart])));
    return false;
  }
  if (phase_ == Phase::kMoving) check_commands_are_taken(view);
  return phase_ == Phase::kMoving || phase_ == Phase::kProbing;
}

/// Adds up how far the desired joints followed the last command. Motion counts even if the
/// controller takes it back later, when it sets them to the measured ones after a hold-up.
void Follower::note_taken(const RobotView& view) {
  const Vector3d moved = view.desired_ji - last_desired_ji_;
  last_desired_ji_ = view.desired_ji;
  window_taken_ji_ += moved.cwiseProduct(last_increment_ji_.cwiseSign()).cwiseMax(0.0);
}

void Follower::check_commands_are_taken(const RobotView& view) {
  note_taken(view);
  if (view.stamp_ns - window_ns_ < kWindowNs) return;
  for (Index joint = 0; joint < 3; ++joint) {
    const double commanded = window_commanded_ji_[joint];
    if (commanded < kCommandSeen[joint]) continue;
    const double taken = window_taken_ji_[joint];
    if (taken >= kTakenShare * commanded) continue;
    if (std::min(view.stamp_ns - window_ns_, view.seen_ns - window_seen_ns_) < kPatienceNs) return;
    stop(StopReason::kIgnored,
         fmt::format("the controller does not take the commands on {}: {} was told to move by {} "
                     "within {:.0f} s, its desired position followed by {}; is it the {} arm that "
                     "these topics drive?",
                     command_topic(), name_of_joint(joint), joint_text(joint, commanded),
                     1e-9 * static_cast<double>(view.stamp_ns - window_ns_),
                     joint_text(joint, taken), options_.arm));
    return;
  }
  open_window(view);
}

void Follower::open_window(const RobotView& view) {
  window_ns_ = view.stamp_ns;
  window_seen_ns_ = view.seen_ns;
  window_commanded_ji_.setZero();
  window_taken_ji_.setZero();
  last_desired_ji_ = view.desired_ji;
}

Command Follower::step(const RobotView& view, double dt_s) {
  const MotionLimits& limits = options_.limits;
  const Vector3d lag = path_.at(along_s_) - view.joints_ji;
  // The place on the path waits for the arm: after a pause it first comes back to where it was.
  const double worst = lag.cwiseAbs().cwiseQuotient(kLongestLag).maxCoeff();
  const double rate = std::clamp(1.0 - worst, 0.0, 1.0);
  const Vector3d from = path_.at(along_s_);
  along_s_ = std::min(along_s_ + rate * dt_s, path_.duration_s());
  const Vector3d target = path_.at(along_s_);
  const Vector3d wanted = (target - from) + dt_s * kGainPerS * lag;
  Vector3d increment =
      clipped(wanted, (dt_s * limits.max_speed_ji_per_s).cwiseMin(limits.max_increment_ji));
  // The desired joints stay inside the limits; if they are outside, they only come closer.
  const Vector3d& desired = view.desired_ji;
  increment = increment.cwiseMin((limits.high_ji - desired).cwiseMax(0.0))
                  .cwiseMax((limits.low_ji - desired).cwiseMin(0.0));
  setpoint_ji_ += increment;
  window_commanded_ji_ += increment.cwiseAbs();
  last_increment_ji_ = increment;
  if (along_s_ >= path_.duration_s()) {
    if (near_end_since_ns_ == 0) near_end_since_ns_ = view.stamp_ns;
    const bool arrived = !beyond(target - view.joints_ji, kArrived);
    if (arrived || view.stamp_ns - near_end_since_ns_ > kSettleNs) phase_ = Phase::kDone;
  }
  return {*options_.crtk_arm, false, increment, setpoint_ji_};
}

}  // namespace ravencal::robot
