// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/ros_program.hpp"
#include "core/terminal.hpp"
#include "robot/run_plan.hpp"

namespace ravencal::commands {
namespace {

/// Checks the trajectory here, so that a wrong one is refused without ROS.
core::Status run(const robot::RunArguments& arguments) {
  if (!arguments.looks_only()) {
    RAVENCAL_ASSIGN_OR_RETURN(const robot::RunPlan plan, robot::make_plan(arguments));
    if (arguments.dry_run) {
      core::say("{}", arguments.json ? robot::plan_json(arguments, plan)
                                     : robot::plan_text(arguments, plan));
      return {};
    }
  }
  return become_ros_program("run");
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<robot::RunArguments>();
  CLI::App* command = app.add_subcommand("run", "Lead a robot along a trajectory and record (ROS)");
  robot::add_run_arguments(*command, *arguments);
  on_call(*command, exit_code, {.read = {"--trajectory"}, .written = {"--out"}},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
