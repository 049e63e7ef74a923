// SPDX-License-Identifier: Apache-2.0
//
// The part of ravencal that needs ROS 1, as a program of its own, so that the rest does not.
// `ravencal run` and `ravencal robot` start it with their own arguments.

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/program.hpp"
#include "cli/words.hpp"
#include "core/terminal.hpp"
#include "core/version.hpp"
#include "robot/robot_arguments.hpp"
#include "robot/run_plan.hpp"
#include "ros/robot_node.hpp"
#include "ros/run_node.hpp"

namespace {

namespace cli = ravencal::cli;

int failed(const char* command, const ravencal::core::Error& error) {
  ravencal::core::remark("ravencal {}: {}\n", command, error.message);
  return cli::exit_code_of(error.code);
}

int run(const ravencal::robot::RunArguments& arguments) {
  const auto result = ravencal::ros_io::run_node(arguments, [] { return !cli::interrupted(); });
  return result.ok() ? static_cast<int>(*result) : failed("run", result.error());
}

int robot(const ravencal::robot::RobotArguments& arguments) {
  const auto status =
      ravencal::ros_io::run_robot_node(arguments, [] { return !cli::interrupted(); });
  return status.ok() ? static_cast<int>(cli::kOk) : failed("robot", status.error());
}

int parse_and_run(int argc, char** argv) {
  // Without the variable ros::init aborts; this is what ROS's own set-up files say.
  (void)::setenv("ROS_MASTER_URI", "http://localhost:11311", 0);
  int exit_code = cli::kOk;
  CLI::App app{"ravencal-ros: the parts of ravencal that need ROS 1"};
  app.set_version_flag("--version", std::string("ravencal-ros ") + ravencal::core::kVersion);
  app.require_subcommand(1);
  ravencal::robot::RunArguments run_arguments;
  CLI::App* run_command = app.add_subcommand("run", "Lead the robot along a trajectory and record");
  ravencal::robot::add_run_arguments(*run_command, run_arguments);
  ravencal::robot::RobotArguments robot_arguments;
  CLI::App* robot_command = app.add_subcommand("robot", "A virtual RAVEN-II on ROS");
  ravencal::robot::add_robot_arguments(*robot_command, robot_arguments);
  cli::end_cleanly_at_signals();
  cli::check_numbers(app);
  try {
    app.parse(argc, argv);
    cli::catch_interrupts();
    exit_code = run_command->parsed() ? run(run_arguments) : robot(robot_arguments);
  } catch (const CLI::ParseError& error) {
    return cli::explain(app, error);
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  return cli::run_program("ravencal-ros", [&] { return parse_and_run(argc, argv); });
}
