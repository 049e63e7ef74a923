// SPDX-License-Identifier: Apache-2.0
#include "robot/robot_arguments.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "physics/raven_arms.hpp"

namespace ravencal::robot {

void add_robot_arguments(CLI::App& command, RobotArguments& arguments) {
  VirtualControllerOptions& controller = arguments.controller;
  command
      .add_option("--plant", arguments.plant, "The robot (.toml), e.g. tools/plants/raven2.toml")
      ->required();
  command
      .add_option("--arm", arguments.arm, "The arm with plugin and encoders; default: the plant's")
      ->check(CLI::IsMember({"gold", "green"}));
  command
      .add_option("--controller", arguments.controller_branch,
                  "Branch of the control program: main, crtk; default: the plant's, else crtk. "
                  "main has no CRTK topics on the real robot; here it gets those of crtk")
      ->check(CLI::IsMember({"main", "crtk"}));
  command.add_option("--plugin", controller.plugin, "libravencal_plugin.so, run at the hook");
  command.add_option("--weights", controller.weights, "Weights for the plugin (.blob)");
  command.add_option("--telemetry", controller.telemetry,
                     "The plugin's shared memory for `ravencal monitor`, like /ravencal-gold");
  command.add_option("--seed", controller.seed, "Disturbances")->capture_default_str();
  command.add_option("--homing-seed", controller.homing_seed, "Power-on and homing")
      ->capture_default_str();
  command.add_flag("--homed", controller.homed, "Start homed with the pedal up, not at the E-stop");
  command.add_flag("--pedal-down", arguments.pedal_down, "Start with the pedal down");
  command
      .add_option("--first-arm", arguments.first_arm,
                  "The arm that /arm1 drives: the one whose board has the higher serial number; "
                  "default: green for crtk, gold for main")
      ->check(CLI::IsMember({"gold", "green"}));
  command.add_flag("--no-encoders", arguments.no_encoders,
                   "Without external encoders: no ext_jpos, no joint_enc");
  command
      .add_option("--speed", arguments.loop.speed,
                  "Robot seconds per second; above 1 states come every 10 ms of robot time")
      ->check(CLI::Range(0.1, 50.0))
      ->capture_default_str();
  command.add_option("--wait-s", arguments.wait_s, "Wait so long for a ROS master")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  command.add_option("--duration-s", arguments.duration_s, "End after so long; default: Ctrl-C")
      ->check(CLI::Range(0.0, 1e9));
  command.footer(
      "A ROS 1 node r2_control with both arms and the topics of the controller's CRTK branch:\n"
      "ravenstate, operating_state, arm1, arm2 with that branch's own mixture of arms (commands "
      "go\n"
      "by the boards' order, measured_js by the arm's name, measured_cp crosswise), and the "
      "external\n"
      "encoders' ext_jpos. Joint commands only: servo_jr, servo_jp, servo_jv. Services stand for "
      "the operator's hands:\n"
      "  rosservice call /r2_control/estop false; rosservice call /r2_control/start\n"
      "  rosservice call /r2_control/pedal true\n"
      "Examples: ravencal robot --plant tools/plants/raven2.toml\n"
      "          ravencal robot --plant tools/plants/raven2.toml --controller main --homed\n"
      "          ravencal robot --plant tools/plants/raven2.toml --first-arm gold   # the "
      "authors'");
}

core::Result<VirtualController> make_virtual_controller(const RobotArguments& arguments,
                                                        physics::Plant& plant) {
  RAVENCAL_ASSIGN_OR_RETURN(plant, physics::load_plant(arguments.plant));
  if (!arguments.controller_branch.empty() || plant.robot.controller.name.empty()) {
    const std::string& name = arguments.controller_branch;
    plant.robot.controller = *physics::find_controller_branch(name.empty() ? "crtk" : name);
  }
  // Commands come by the clock of those who send them, however fast the robot's time runs.
  physics::ControllerBranch& branch = plant.robot.controller;
  branch.cycles_to_reseed =
      static_cast<int>(std::ceil(branch.cycles_to_reseed * std::max(1.0, arguments.loop.speed)));
  if (!arguments.first_arm.empty())
    plant.robot.controller.green_arm_first = arguments.first_arm == "green";
  if (!arguments.arm.empty()) plant = physics::plant_of_arm(plant, arguments.arm);
  if (arguments.controller.plugin.empty() &&
      !(arguments.controller.weights.empty() && arguments.controller.telemetry.empty())) {
    return core::Error{core::ErrorCode::kUsage, "--weights and --telemetry need --plugin"};
  }
  return VirtualController::create(plant, arguments.controller);
}

}  // namespace ravencal::robot
