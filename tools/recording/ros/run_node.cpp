// SPDX-License-Identifier: Apache-2.0
#include "ros/run_node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "cli/progress.hpp"
#include "core/terminal.hpp"
#include "ros/run_watch.hpp"

namespace ravencal::ros_io {
namespace {

using Clock = std::chrono::steady_clock;
using robot::Phase;
using robot::StopReason;

constexpr auto kPoll = std::chrono::milliseconds(5);
constexpr auto kLook = std::chrono::milliseconds(20);
constexpr double kReadingsStaleS = 2.0;  // of the external encoders, by the caller's clock
constexpr std::int64_t kEnoughStates = 20;
constexpr double kSilentWaitS = 2.0;                         // before it says what it waits for
constexpr auto kLastWords = std::chrono::milliseconds(100);  // for the last message to leave

class Run {
 public:
  Run(const robot::RunArguments& arguments, const std::function<bool()>& keep_going)
      : arguments_(arguments), keep_going_(keep_going) {}

  core::Result<cli::ExitCode> run();

 private:
  core::Status connect();
  core::Status wait_for_messages();
  core::Status refuse_other_senders() const;
  core::Result<cli::ExitCode> look();
  core::Result<cli::ExitCode> move(robot::RunPlan plan);
  void watch_motion();
  void show(const Standing& standing);
  core::Result<cli::ExitCode> report(const core::Status& recording);

  [[nodiscard]] double waited_s() const {
    return std::chrono::duration<double>(Clock::now() - start_).count();
  }
  [[nodiscard]] bool may_wait() const {
    return keep_going_() && ros::ok() && waited_s() < arguments_.wait_s;
  }
  [[nodiscard]] std::string missing(const Heard& heard) const;

  const robot::RunArguments& arguments_;
  const std::function<bool()>& keep_going_;
  Clock::time_point start_ = Clock::now();
  std::unique_ptr<ros::NodeHandle> node_;
  std::unique_ptr<MasterWatch> master_;
  std::unique_ptr<RunWatch> watch_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;  // stopped before what its callbacks use
  std::unique_ptr<cli::Progress> progress_;
  std::string shown_;  // the last thing waited for
  bool master_was_lost_ = false;
};

core::Status Run::connect() {
  ros::init(ros::M_string(), "ravencal_run",
            ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  const auto keep_waiting = [&] {
    if (waited_s() > kSilentWaitS && shown_.empty()) {
      shown_ = fmt::format("no ROS master at {}", ros::master::getURI());
      core::remark("ravencal run: {}; waiting\n", shown_);
    }
    return may_wait();
  };
  if (!wait_for_master(keep_waiting)) {
    return core::device_error(
        fmt::format("no ROS master at {}; start roscore and the robot, or set "
                    "ROS_MASTER_URI",
                    ros::master::getURI()));
  }
  ros::master::setRetryTimeout(ros::WallDuration(1.0));
  node_ = std::make_unique<ros::NodeHandle>();
  master_ = std::make_unique<MasterWatch>();
  watch_ = std::make_unique<RunWatch>(*node_, *master_, arguments_);
  spinner_ = std::make_unique<ros::AsyncSpinner>(1);
  spinner_->start();
  master_->start();
  return {};
}

std::string Run::missing(const Heard& heard) const {
  if (!heard.refused.empty()) return heard.refused;
  if (heard.states == 0)
    return "nobody publishes /ravenstate; is the robot's control process running?";
  if (heard.operating_states == 0) {
    return "nobody publishes /operating_state: the control process has no CRTK interface (branch "
           "crtk of raven2)";
  }
  if (!arguments_.no_encoders && heard.readings == 0) {
    return "no external encoders on /ext_jpos; start `ravencal-encoders --publish-ros`, or give "
           "--no-encoders";
  }
  return heard.states < kEnoughStates ? "too few states on /ravenstate" : "";
}

core::Status Run::wait_for_messages() {
  for (;;) {
    const Heard heard = watch_->heard();
    const std::string why = missing(heard);
    if (why.empty()) return {};
    if (!heard.refused.empty() || !may_wait()) return core::device_error(why);
    if (waited_s() > kSilentWaitS && why != shown_) {
      core::remark("ravencal run: {}; waiting\n", why);
      shown_ = why;
    }
    std::this_thread::sleep_for(kPoll);
  }
}

/// Two followers on one arm would add up their increments.
core::Status Run::refuse_other_senders() const {
  XmlRpc::XmlRpcValue arguments;
  arguments[0] = ros::this_node::getName();
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue state;
  if (!ros::master::execute("getSystemState", arguments, response, state, false)) return {};
  XmlRpc::XmlRpcValue& publishers = state[0];
  for (int i = 0; i < publishers.size(); ++i) {
    const std::string topic = static_cast<std::string>(publishers[i][0]);
    const std::vector<robot::CrtkArm> arms = arguments_.crtk_arms();
    const bool ours = std::any_of(arms.begin(), arms.end(), [&](robot::CrtkArm arm) {
      return topic.starts_with(robot::command_topic_of(arm, ""));
    });
    if (!ours) continue;
    for (int k = 0; k < publishers[i][1].size(); ++k) {
      const std::string sender = static_cast<std::string>(publishers[i][1][k]);
      if (sender == ros::this_node::getName()) continue;
      return core::device_error(fmt::format("{} sends {} already; end it first", sender, topic));
    }
  }
  return {};
}

core::Result<cli::ExitCode> Run::look() {
  Heard heard = watch_->heard();
  while (arguments_.await_homed && !heard.homed) {
    if (!may_wait()) return core::device_error("the robot is not homed");
    if (heard.silent_s > std::max(1.0, arguments_.stale_s))
      return core::device_error("the robot's control process has fallen silent");
    std::this_thread::sleep_for(kPoll);
    heard = watch_->heard();
  }
  if (arguments_.json) {
    const nlohmann::ordered_json json = {{"master", ros::master::getURI()},
                                         {"state_rate_hz", heard.state_rate_hz},
                                         {"runlevel", heard.runlevel},
                                         {"operating_state", robot::name_of(heard.operating)},
                                         {"homed", heard.homed},
                                         {"encoders", heard.readings > 0},
                                         {"measured_js", heard.measured_js}};
    core::say("{}\n", json.dump(2));
    return cli::kOk;
  }
  core::say("robot on {}: states at {:.0f} Hz, run level {}, {}, {}{}\n", ros::master::getURI(),
            heard.state_rate_hz, heard.runlevel, robot::name_of(heard.operating),
            heard.homed ? "homed" : "not homed",
            heard.readings > 0 ? ", external encoders there" : "");
  if (!heard.measured_js.empty()) {
    core::say("the {} arm's joints are on {}; ravencal takes them from /ravenstate\n",
              arguments_.arm, heard.measured_js);
  }
  return cli::kOk;
}

void Run::show(const Standing& standing) {
  const bool waits = standing.phase == Phase::kWaiting || standing.phase == Phase::kPaused;
  const std::string wanted =
      waits ? "waiting for " + standing.waiting_for
      : standing.phase == Phase::kProbing
          ? "moves an elbow by 0.3 deg and back to learn which CRTK arm is the " + arguments_.arm +
                " one"
          : "";
  if (!wanted.empty() && wanted != shown_) core::remark("ravencal run: {}\n", wanted);
  shown_ = wanted;
  if (!master_->reachable() && !master_was_lost_) {
    core::remark("ravencal run: the ROS master is gone; the robot is still connected\n");
  }
  master_was_lost_ = !master_->reachable();
  progress_->update(standing.progress,
                    fmt::format("{:.1f} min of motion left, {} rows{}", standing.left_s / 60.0,
                                standing.rows, wanted.empty() ? "" : ", " + wanted));
}

void Run::watch_motion() {
  Clock::time_point next_look = Clock::now();
  for (;;) {
    watch_->drive(kPoll);
    if (Clock::now() < next_look) continue;
    next_look = Clock::now() + kLook;
    const Standing standing = watch_->standing();
    if (standing.phase == Phase::kDone || standing.phase == Phase::kStopped) return;
    show(standing);
    const Heard heard = watch_->heard();
    if (!keep_going_()) watch_->stop(StopReason::kUser, "ended by the user");
    if (!ros::ok()) watch_->stop(StopReason::kReplaced, "another node took the name ravencal_run");
    const double longest_s = std::max(kReadingsStaleS, arguments_.stale_s);
    // Where states are silent as well, the control process is gone and with it the readings.
    const bool states_come = heard.silent_s < 0.5 * longest_s;
    if (!arguments_.no_encoders && standing.phase == Phase::kMoving && states_come &&
        heard.readings_silent_s > longest_s) {
      watch_->stop(
          StopReason::kStale,
          fmt::format("no reading of the external encoders for {:.1f} s", heard.readings_silent_s));
    }
    if (standing.phase == Phase::kWaiting && !may_wait() && keep_going_()) {
      watch_->stop(StopReason::kStale,
                   fmt::format("waited {:.0f} s for {}", waited_s(), standing.waiting_for));
    }
  }
}

core::Result<cli::ExitCode> Run::move(robot::RunPlan plan) {
  RAVENCAL_RETURN_IF_ERROR(refuse_other_senders());
  robot::RunRecorderOptions recording;
  recording.path = arguments_.out;
  recording.arm = arguments_.arm;
  recording.rate_hz = arguments_.rate_hz;
  recording.trajectory = std::filesystem::path(arguments_.trajectory).filename().string();
  recording.overwrite = arguments_.force;
  RAVENCAL_ASSIGN_OR_RETURN(robot::RunRecorder recorder, robot::RunRecorder::create(recording));
  progress_ = std::make_unique<cli::Progress>("run");
  watch_->begin(robot::Follower(plan.trajectory, plan.follower), std::move(recorder));
  watch_motion();
  progress_.reset();
  const core::Status closed = watch_->finish();
  std::this_thread::sleep_for(kLastWords);
  spinner_->stop();
  return report(closed);
}

core::Result<cli::ExitCode> Run::report(const core::Status& recording) {
  const Standing standing = watch_->standing();
  const bool done = standing.phase == Phase::kDone;
  // An empty recording would only block the next attempt.
  const bool empty = standing.rows == 0;
  if (empty) {
    std::error_code ignored;
    std::filesystem::remove(arguments_.out, ignored);
  }
  if (arguments_.json) {
    const nlohmann::ordered_json json = {{"completed", done},
                                         {"progress", standing.progress},
                                         {"pauses", standing.pauses},
                                         {"file", empty ? "" : arguments_.out},
                                         {"rows", standing.rows},
                                         {"rows_with_truth", standing.rows_with_truth},
                                         {"stopped_by", standing.stop.text},
                                         {"master_restarts", master_->restarts()}};
    core::say("{}\n", json.dump(2));
  } else {
    const std::string kept = fmt::format("{}: {} rows, {} with true joints", arguments_.out,
                                         standing.rows, standing.rows_with_truth);
    core::say("{}; {:.1f} % of the trajectory, {} pauses\n", empty ? "nothing was recorded" : kept,
              100.0 * standing.progress, standing.pauses);
  }
  RAVENCAL_RETURN_IF_ERROR(recording);
  if (done) return cli::kOk;
  core::remark("ravencal run: stopped: {}{}\n", standing.stop.text,
               empty ? "" : "; the recording is kept");
  // Ctrl-C is a normal end of a recorder.
  return standing.stop.reason == StopReason::kUser ? cli::kOk : cli::kDevice;
}

core::Result<cli::ExitCode> Run::run() {
  robot::RunPlan plan;
  if (!arguments_.looks_only()) {
    RAVENCAL_ASSIGN_OR_RETURN(plan, robot::make_plan(arguments_));
    if (!arguments_.force && std::filesystem::exists(arguments_.out)) {
      return core::Error{
          core::ErrorCode::kUsage,
          fmt::format("{}: exists already; use --force to replace it", arguments_.out)};
    }
  }
  RAVENCAL_RETURN_IF_ERROR(connect());
  RAVENCAL_RETURN_IF_ERROR(wait_for_messages());
  return arguments_.looks_only() ? look() : move(std::move(plan));
}

}  // namespace

core::Result<cli::ExitCode> run_node(const robot::RunArguments& arguments,
                                     const std::function<bool()>& keep_going) {
  core::Result<cli::ExitCode> result = Run(arguments, keep_going).run();
  if (ros::isInitialized()) ros::shutdown();
  return result;
}

}  // namespace ravencal::ros_io
