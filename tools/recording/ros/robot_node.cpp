// SPDX-License-Identifier: Apache-2.0
#include "ros/robot_node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <thread>
#include <utility>

#include "core/terminal.hpp"
#include "ros/messages.hpp"
#include "ros/robot_topics.hpp"

namespace ravencal::ros_io {
namespace {

using Clock = std::chrono::steady_clock;
using robot::Button;
using robot::CommandKind;
using robot::CrtkArm;
using robot::RobotInput;

constexpr std::uint32_t kCommandQueue = 1000;
constexpr std::uint32_t kServoQueue = 1;  // local_io.cpp: of a burst, the last message is heard
constexpr auto kTickPoll = std::chrono::microseconds(300);
constexpr double kPublishPeriodS = 0.01;  // of robot time, faster than real time

std::int64_t wall_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::optional<Button> button_of(const std::string& command) {
  const std::string name = lower(command);
  if (name == "pause") return Button::kPedalUp;
  if (name == "resume" || name == "enable") return Button::kPedalDown;
  if (name == "disable") return Button::kEmergencyStop;
  if (name == "home" || name == "unhome") return Button::kUnhome;
  return std::nullopt;
}

/// What the node hears. Callbacks run in the one spinner thread, which alone feeds the loop.
class Ears {
 public:
  Ears(ros::NodeHandle& node, MasterWatch& watch, robot::RobotLoop& loop) : loop_(loop) {
    for (const char* arm : {"/arm1/", "/arm2/"}) {
      const CrtkArm name = std::string(arm) == "/arm1/" ? CrtkArm::kArm1 : CrtkArm::kArm2;
      hear_joints(node, watch, std::string(arm) + "servo_jr", name, CommandKind::kRelative);
      hear_joints(node, watch, std::string(arm) + "servo_jp", name, CommandKind::kAbsolute);
      hear_joints(node, watch, std::string(arm) + "servo_jv", name, CommandKind::kVelocity);
      hear_commands(node, watch, std::string(arm) + "state_command");
    }
    hear_commands(node, watch, "/state_command");
    serve(node, watch);
  }

 private:
  void hear_joints(ros::NodeHandle& node, MasterWatch& watch, const std::string& topic, CrtkArm arm,
                   CommandKind kind) {
    watch.add_subscription(topic, std::string(record::joint_state_type().name));
    subscribers_.push_back(
        subscribe(node, topic, kServoQueue, [this, topic, arm, kind](auto bytes, const auto& type) {
          if (!fits(topic, type, record::joint_state_type())) return;
          const auto message = record::decode_joint_state(bytes);
          if (!message) return;
          const auto& values =
              kind == CommandKind::kVelocity ? message->velocities : message->positions;
          if (values.size() < 3) return;
          RobotInput input;
          input.kind = RobotInput::Kind::kCommand;
          input.arm = arm;
          input.command = kind;
          input.joints = {values[0], values[1], values[2]};
          (void)loop_.send(input);
        }));
  }

  void hear_commands(ros::NodeHandle& node, MasterWatch& watch, const std::string& topic) {
    watch.add_subscription(topic, std::string(string_stamped_type().name));
    subscribers_.push_back(
        subscribe(node, topic, kCommandQueue, [this, topic](auto bytes, const auto& type) {
          if (!fits(topic, type, string_stamped_type())) return;
          const auto message = decode_string_stamped(bytes);
          const auto button = message ? button_of(message->text) : std::nullopt;
          if (button) press(*button);
        }));
  }

  void serve(ros::NodeHandle& node, MasterWatch& watch) {
    for (const char* name : {"/r2_control/estop", "/r2_control/pedal", "/r2_control/start"})
      watch.add_service(name);
    services_.push_back(serve_set_bool(node, "/r2_control/estop", [this](bool pressed) {
      press(pressed ? Button::kEmergencyStop : Button::kEmergencyStopRelease);
      return Answer{true, pressed ? "the E-stop is pressed" : "the E-stop is released"};
    }));
    services_.push_back(serve_set_bool(node, "/r2_control/pedal", [this](bool down) {
      press(down ? Button::kPedalDown : Button::kPedalUp);
      return Answer{true, down ? "the pedal is down" : "the pedal is up"};
    }));
    services_.push_back(serve_trigger(node, "/r2_control/start", [this] {
      press(Button::kStart);
      return Answer{true, "the silver button is pressed"};
    }));
  }

  void press(Button button) {
    RobotInput input;
    input.button = button;
    (void)loop_.send(input);
  }

  bool fits(const std::string& topic, const ReceivedType& type,
            const record::RosMessageType& expected) {
    const std::string mismatch = type_mismatch(topic, type, expected);
    if (mismatch.empty()) return true;
    if (!complained_) core::remark("ravencal robot: {}\n", mismatch);
    complained_ = true;
    return false;
  }

  robot::RobotLoop& loop_;
  bool complained_ = false;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
};

robot::RobotLoopOptions loop_options(const robot::RobotArguments& arguments, double rate_hz) {
  robot::RobotLoopOptions options = arguments.loop;
  if (options.speed > 1.0) options.publish_every = static_cast<int>(kPublishPeriodS * rate_hz);
  return options;
}

void report_start(const robot::RobotLoop& loop, const robot::RobotArguments& arguments,
                  const physics::Plant& plant) {
  core::say("virtual RAVEN, branch {}, encoders on the {} arm, on {}; {}\n",
            plant.robot.controller.name, plant.robot.arm, ros::master::getURI(),
            arguments.controller.homed ? "homed, pedal up"
                                       : "at the E-stop: release it, then press start");
  if (!loop.hindrance().empty()) core::say("not in real time: {}\n", loop.hindrance());
}

}  // namespace

core::Status run_robot_node(const robot::RobotArguments& arguments,
                            const std::function<bool()>& keep_going) {
  physics::Plant plant;
  RAVENCAL_ASSIGN_OR_RETURN(robot::VirtualController controller,
                            robot::make_virtual_controller(arguments, plant));
  const double rate_hz = controller.rate_hz();
  robot::RobotLoop loop(std::move(controller), loop_options(arguments, rate_hz));
  if (arguments.pedal_down) {
    RobotInput input;
    input.button = Button::kPedalDown;
    (void)loop.send(input);
  }
  ros::init(ros::M_string(), "r2_control",
            ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  const auto start = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  if (!wait_for_master([&] { return keep_going() && seconds() < arguments.wait_s; })) {
    return core::Error{core::ErrorCode::kDevice,
                       fmt::format("no ROS master at {} within {:.0f} s; start roscore",
                                   ros::master::getURI(), seconds())};
  }
  ros::master::setRetryTimeout(ros::WallDuration(1.0));
  {
    ros::NodeHandle node;
    MasterWatch watch;
    RobotTopics topics(node, watch, plant, !arguments.no_encoders, wall_ns());
    const Ears ears(node, watch, loop);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    watch.start();
    loop.start();
    report_start(loop, arguments, plant);
    robot::CycleOutput output;
    while (keep_going() && ros::ok() && loop.running() &&
           (arguments.duration_s <= 0.0 || seconds() < arguments.duration_s)) {
      while (loop.receive(output)) topics.publish(output);
      std::this_thread::sleep_for(kTickPoll);
    }
    spinner.stop();
    loop.stop();
  }
  ros::shutdown();
  core::say("{} cycles, {} missed, {} states not published\n", loop.cycles(), loop.overruns(),
            loop.not_taken());
  return {};
}

}  // namespace ravencal::ros_io
