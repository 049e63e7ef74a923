// SPDX-License-Identifier: Apache-2.0
#include "control/control.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"

namespace ravencal::commands {
namespace {

/// In the order of RAVENCAL_REQUEST_*, up to the constant, which `ravencal rezero` asks for.
constexpr std::array<const char*, RAVENCAL_REQUEST_HOMING_CONSTANT> kWords = {
    "off", "arm", "shadow", "share", "reset"};
constexpr std::array<const char*, RAVENCAL_JOINTS> kJoints = {"shoulder", "elbow", "insertion"};

struct Arguments {
  std::string what;
  double percent = -1.0;
  std::vector<std::string> joints;
  std::string name;
  std::optional<double> wait_s;
};

constexpr double kUsualWait_s = 2.0;

core::Error usage(const std::string& what) { return {core::ErrorCode::kUsage, what}; }

core::Result<control::Request> request_of(const Arguments& arguments) {
  control::Request request;
  const auto word = std::find(kWords.begin(), kWords.end(), arguments.what);
  request.kind = static_cast<std::uint32_t>(std::distance(kWords.begin(), word));
  request.stays = !arguments.wait_s;
  const bool is_share = request.kind == RAVENCAL_REQUEST_SHARE;
  if (is_share != (arguments.percent >= 0.0)) {
    return usage(is_share ? "share needs a percentage: ravencal control share 10 --name N"
                          : fmt::format("'{}' takes no percentage", arguments.what));
  }
  if (!is_share && !arguments.joints.empty()) return usage("--joints belongs to share");
  if (!is_share) return request;
  request.share = static_cast<float>(arguments.percent / 100.0);
  if (arguments.joints.empty()) return request;
  request.joints = 0;
  for (const std::string& joint : arguments.joints) {
    const auto found = std::find(kJoints.begin(), kJoints.end(), joint);
    if (found == kJoints.end()) {
      return usage(fmt::format("--joints: '{}' is none of {}", joint, fmt::join(kJoints, ", ")));
    }
    request.joints |= 1U << std::distance(kJoints.begin(), found);
  }
  return request;
}

/// "off" ends every correction; whatever begins one says which.
core::Result<std::vector<std::string>> names_of(const Arguments& arguments) {
  if (!arguments.name.empty()) return std::vector{arguments.name};
  std::vector<std::string> names = control::own_names();
  const std::string existing = names.empty() ? "there is none of this user on this machine"
                                             : fmt::format("there are: {}", fmt::join(names, ", "));
  if (arguments.what != "off") {
    return usage(fmt::format("'{}' needs --name; {}", arguments.what, existing));
  }
  if (names.empty()) {
    return core::Error{core::ErrorCode::kIo, "no controller with telemetry: " + existing};
  }
  return names;
}

int exit_code_of(control::Answer answer) {
  if (answer == control::Answer::kStands) return cli::kData;
  const bool is_well =
      answer == control::Answer::kTaken || answer == control::Answer::kWaitsForPedal;
  return is_well ? cli::kOk : cli::kFinding;
}

core::Status run(const Arguments& arguments, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const control::Request request, request_of(arguments));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::string> names, names_of(arguments));
  cli::catch_interrupts();
  const double wait_s = arguments.wait_s.value_or(kUsualWait_s);
  core::Status first;
  for (const std::string& name : names) {
    const auto answer = control::ask(name, request, wait_s, [] { return !cli::interrupted(); });
    if (!answer.ok()) {
      // One controller that is gone keeps no other from being switched off.
      if (first.ok()) first = answer.error();
      continue;
    }
    core::say("{}: {}: {}\n", name, arguments.what, control::sentence_of(answer.value(), wait_s));
    exit_code = std::max(exit_code, exit_code_of(answer.value()));
  }
  return first;
}

}  // namespace

void add_control(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("control", "Ask the plugin in a running controller for a mode or a share");
  command->add_option("what", arguments->what, "off, shadow, arm, share or reset")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kWords.begin(), kWords.end())));
  command->add_option("percent", arguments->percent, "Of share: how much is applied")
      ->check(CLI::Range(0.0, 100.0));
  command
      ->add_option("--joints", arguments->joints,
                   "Of share: shoulder, elbow, insertion; default: all")
      ->delimiter(',');
  command->add_option("--name", arguments->name,
                      "Name of the telemetry, like /ravencal-left; off without it: all of them");
  command
      ->add_option("--wait-s", arguments->wait_s,
                   "Wait so long for the plugin to take it, also for the pedal, and withdraw it "
                   "then; default: 2, and what waits for the pedal is left there")
      ->check(CLI::Range(0.05, 1e6));
  command->footer(
      "shadow shows the correction and applies none; arm applies it; off ends it; reset leaves a\n"
      "FAULT for off. All but off and reset are taken while the pedal is up. Only the user of the\n"
      "control process may ask. Exit 1: not taken; 3: no such controller, or its loop stands.\n"
      "Example: ravencal control share 10 --joints elbow --name /ravencal-left");
  on_call(*command, exit_code, {}, [arguments, &exit_code] { return run(*arguments, exit_code); });
}

}  // namespace ravencal::commands
