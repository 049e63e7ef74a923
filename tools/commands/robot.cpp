// SPDX-License-Identifier: Apache-2.0
#include "robot/robot_arguments.hpp"

#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/ros_program.hpp"

namespace ravencal::commands {

void add_robot(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<robot::RobotArguments>();
  CLI::App* command = app.add_subcommand("robot", "Run a virtual RAVEN-II on ROS: the twin, live");
  robot::add_robot_arguments(*command, *arguments);
  on_call(*command, exit_code, {.read = {"--plant", "--plugin", "--weights"}}, [arguments] {
    (void)arguments;  // the options write into it until here
    return become_ros_program("robot");
  });
}

}  // namespace ravencal::commands
