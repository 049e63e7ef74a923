// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <memory>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/ros_program.hpp"
#include "core/terminal.hpp"
#include "robot/calibration_steps.hpp"

extern char** environ;

namespace ravencal::commands {
namespace {

struct CalibrateArguments {
  robot::CalibrationOptions options;
  std::string folder;
  bool yes = false;
};

/// `ravencal` with these arguments; the value is its exit code. Ctrl-C reaches it, too: it belongs
/// to the same group.
core::Result<int> run_command(std::vector<std::string> arguments) {
  const std::string program = own_path().string();
  std::vector<char*> pointers = {const_cast<char*>(program.c_str())};
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  pid_t child = 0;
  const int error =
      ::posix_spawn(&child, program.c_str(), nullptr, nullptr, pointers.data(), environ);
  if (error != 0) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be started: {}", program, std::strerror(error))};
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Waits for Enter. Error: standard input has ended.
core::Status ask(const robot::CalibrationStep& step, bool yes) {
  if (step.instruction.empty()) return {};
  core::say("  {}\n", step.instruction);
  if (yes) return {};
  core::say("  Enter continues, Ctrl-C ends: ");
  std::string line;
  if (std::getline(std::cin, line)) return {};
  return core::Error{core::ErrorCode::kUsage, "no answer; --yes skips the questions"};
}

core::Status run_step(const robot::CalibrationStep& step, bool yes, int& exit_code) {
  RAVENCAL_RETURN_IF_ERROR(ask(step, yes));
  if (step.moves) RAVENCAL_RETURN_IF_ERROR(robot::set_aside(step.output));
  RAVENCAL_ASSIGN_OR_RETURN(exit_code, run_command(step.command));
  return {};
}

core::Status run(const CalibrateArguments& arguments, int& exit_code) {
  if (!find_ros_program()) {
    return core::Error{core::ErrorCode::kUsage,
                       "this needs ROS 1: install the package ravencal-ros, or libroscpp-dev and "
                       "build ravencal again"};
  }
  cli::catch_interrupts_of_work();
  RAVENCAL_ASSIGN_OR_RETURN(robot::CalibrationSession session,
                            robot::CalibrationSession::open(arguments.options));
  const auto steps = robot::calibration_steps(arguments.options);
  if (session.continued()) core::say("continuing {}\n", arguments.folder);
  int number = 0;
  for (const robot::CalibrationStep& step : steps) {
    ++number;
    const bool done = session.done(step);
    core::say("[{}/{}] {}{}\n", number, steps.size(), step.title, done ? ": done before" : "");
    if (done) continue;
    RAVENCAL_RETURN_IF_ERROR(run_step(step, arguments.yes, exit_code));
    if (exit_code != cli::kOk) {
      core::remark(
          "ravencal calibrate: '{}' failed (exit {}); the same command continues from here\n",
          step.title, exit_code);
      return {};
    }
    // An interrupted step has an end of its own, such as a recording, but is not done.
    if (cli::interrupted()) return {};
    RAVENCAL_RETURN_IF_ERROR(session.mark_done(step));
  }
  core::say("\n{}", robot::what_to_load(arguments.options));
  return {};
}

cli::Paths folder_of_session(const CLI::App& command) {
  const std::filesystem::path folder = cli::path_of(command, "--out");
  if (!cli::is_record_of_run(folder / "calibrate.json", {"settings", "done"})) return {};
  return {folder};
}

}  // namespace

void add_calibrate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CalibrateArguments>();
  robot::CalibrationOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("calibrate", "Calibrate a robot step by step (ROS)");
  command
      ->add_option("--out", arguments->folder,
                   "Folder of the session; the same folder continues it")
      ->required();
  command->add_option("--arm", options.arm, "The arm with the external encoders")
      ->check(CLI::IsMember({"gold", "green"}))
      ->capture_default_str();
  command
      ->add_option(
          "--crtk-arm", options.crtk_arm,
          "The CRTK arm that drives it: arm1 or arm2; default: a probe at the start of each run")
      ->check(CLI::IsMember({"arm1", "arm2"}));
  command->add_option("--sparsities", options.sparsities, "Zig-zags to train on")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--validate-s", options.validate_s, "Random motion that chooses the epoch, s")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  command->add_option("--test-s", options.test_s, "Random motion that tests the result, s")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  command->add_option("--features", options.features, "As in `ravencal train`")
      ->capture_default_str();
  command->add_option("--hidden", options.hidden, "As in `ravencal train`")->capture_default_str();
  command->add_option("--epochs", options.epochs, "As in `ravencal train`")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--precision", options.precision, "As in `ravencal convert`")
      ->check(CLI::IsMember({"f32", "bf16", "int8"}))
      ->capture_default_str();
  command->add_option("--stale-s", options.stale_s, "As in `ravencal run`")
      ->check(CLI::Range(0.02, 30.0))
      ->capture_default_str();
  command->add_option("--wait-s", options.wait_s, "As in `ravencal run`")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  command->add_flag("--yes", arguments->yes,
                    "Skip the questions: for the virtual robot and for tests");
  command->footer(
      "Check, home, zig-zags, random motion, training, report, weights, what to load.\n"
      "The same command continues a session that was stopped.\n"
      "Example: ravencal calibrate --out evening1");
  const FileOptions files = {.folders = {"--out"}, .own = folder_of_session};
  on_call(*command, exit_code, files, [arguments, &exit_code] {
    arguments->options.folder = arguments->folder;
    return run(*arguments, exit_code);
  });
}

}  // namespace ravencal::commands
