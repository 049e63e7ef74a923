// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "exchange/load.hpp"
#include "model/homing_constants.hpp"
#include "rezero/constant.hpp"
#include "rezero/constant_file.hpp"
#include "rezero/hand_over.hpp"
#include "rezero/weights.hpp"

namespace ravencal::commands {
namespace {

constexpr double kLongestWait_s = 2.0;

struct RezeroArguments {
  std::string weights;
  std::string recording;
  std::string name;
  std::vector<std::string> at;
  std::vector<std::string> at_most;
  std::optional<double> when_s;
  bool is_dry = false;
  bool ends = false;
  record::LoadOptions load;
};

core::Status check(const RezeroArguments& arguments) {
  if (arguments.recording.empty() && arguments.name.empty()) {
    return core::usage_error(
        "--recording or --name is needed: where the robot's reading comes from, and which plugin "
        "takes the constant");
  }
  if (arguments.ends && (arguments.name.empty() || !arguments.at.empty())) {
    return core::usage_error("--end needs --name, and no --at");
  }
  const bool hands_over_file = arguments.at.empty() && !arguments.ends;
  if (hands_over_file && (!arguments.recording.empty() || arguments.is_dry)) {
    return core::usage_error("--at is needed: the pose in which the robot stands");
  }
  if (arguments.when_s && arguments.recording.empty()) {
    return core::usage_error("--when-s belongs to --recording");
  }
  return {};
}

core::Result<rezero::Reading> read(const RezeroArguments& arguments,
                                   const rezero::Weights& weights) {
  if (arguments.recording.empty()) {
    return rezero::read_telemetry(arguments.name, weights.model, weights.checksum,
                                  [] { return !cli::interrupted(); });
  }
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            exchange::load_recording(arguments.recording, arguments.load));
  return rezero::read_recording(recording, weights.model, arguments.when_s);
}

std::int64_t realtime_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// The constant, from the pose; none where it is refused, which is told.
core::Result<std::optional<rezero::ConstantFile>> take(const RezeroArguments& arguments,
                                                       const rezero::Weights& weights) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto pose, rezero::parse_pose(arguments.at, weights.model));
  RAVENCAL_ASSIGN_OR_RETURN(const auto at_most,
                            rezero::parse_bounds(arguments.at_most, weights.model));
  RAVENCAL_ASSIGN_OR_RETURN(const auto seen, model::homing_constants_of(weights.model));
  RAVENCAL_ASSIGN_OR_RETURN(const rezero::Reading reading, read(arguments, weights));
  rezero::Judgement judgement = rezero::judge(reading, pose, seen, at_most);
  if (!reading.homing && !arguments.is_dry) {
    judgement.refusals.push_back(
        fmt::format("{} does not tell of which homing it is (encoder offsets of joints 1 to 3 that "
                    "stay, of a homed robot): nobody could prove that the constant is that of the "
                    "robot now; --dry-run shows it all the same",
                    reading.source));
  }
  core::say("{}", rezero::table_of(judgement));
  for (const std::string& refusal : judgement.refusals) {
    core::say("refused: {}\n", refusal);
  }
  if (!judgement.refusals.empty()) return std::optional<rezero::ConstantFile>();
  return std::optional(rezero::ConstantFile{weights.checksum,
                                            reading.homing.value_or(rezero::Homing{}),
                                            reading.source, realtime_ns(), judgement.joints});
}

/// What lies beside the weights.
core::Result<rezero::ConstantFile> stored(const RezeroArguments& arguments,
                                          const rezero::Weights& weights) {
  const auto path = rezero::path_beside(arguments.weights);
  RAVENCAL_ASSIGN_OR_RETURN(rezero::ConstantFile file, rezero::read_constant(path));
  if (file.weights_checksum != weights.checksum) {
    return core::data_error(fmt::format(
        "{}: belongs to other weights (checksum {:08x}) than {} ({:08x}); take a pose again",
        path.string(), file.weights_checksum, arguments.weights, weights.checksum));
  }
  return file;
}

core::Status hand_over(const RezeroArguments& arguments, const ravencal_homing_constant& constant,
                       int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const rezero::HandedOver handed,
                            rezero::hand_over(arguments.name, constant, kLongestWait_s,
                                              [] { return !cli::interrupted(); }));
  core::say("{}: {}\n", arguments.name, handed.sentence);
  if (!handed.is_well) exit_code = cli::kFinding;
  return {};
}

core::Status run(const RezeroArguments& arguments, int& exit_code) {
  RAVENCAL_RETURN_IF_ERROR(check(arguments));
  cli::catch_interrupts();
  if (arguments.ends) return hand_over(arguments, {}, exit_code);
  RAVENCAL_ASSIGN_OR_RETURN(const rezero::Weights weights, rezero::load_weights(arguments.weights));
  if (arguments.at.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const rezero::ConstantFile file, stored(arguments, weights));
    return hand_over(arguments, rezero::for_plugin(file), exit_code);
  }
  RAVENCAL_ASSIGN_OR_RETURN(const auto file, take(arguments, weights));
  if (!file) {
    exit_code = cli::kFinding;
    return {};
  }
  if (arguments.is_dry) return {};
  const auto path = rezero::path_beside(arguments.weights);
  RAVENCAL_RETURN_IF_ERROR(rezero::write_constant(*file, path));
  core::say("{}: the constant of this homing\n", path.string());
  if (arguments.name.empty()) return {};
  return hand_over(arguments, rezero::for_plugin(*file), exit_code);
}

cli::Paths path_of_constant(const CLI::App& command) {
  const bool writes = command.count("--at") > 0 && command.count("--dry-run") == 0;
  return writes ? cli::Paths{rezero::path_beside(cli::path_of(command, "--weights"))}
                : cli::Paths();
}

/// A constant of before, of which a new pose makes another one.
cli::Paths earlier_constant(const CLI::App& command) {
  cli::Paths own;
  for (const auto& path : path_of_constant(command)) {
    if (rezero::is_constant_file(path)) own.push_back(path);
  }
  return own;
}

}  // namespace

void add_rezero(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RezeroArguments>();
  CLI::App* command = app.add_subcommand(
      "rezero", "Take out the constant error of this homing, from one known pose");
  command->add_option("--weights", arguments->weights, "Weights (.blob) that the plugin runs")
      ->required();
  command->add_option(
      "--recording", arguments->recording,
      "Read the robot's joints from this recording, in which it stands at the pose");
  command->add_option("--name", arguments->name,
                      "Telemetry of the plugin that takes the constant, like /ravencal-left; "
                      "without --recording also what the robot reads now");
  command
      ->add_option(
          "--at", arguments->at,
          "True joints and their uncertainty (one standard deviation), from a hard stop, a "
          "pin or an external reading: JOINT=VALUE+-UNCERTAINTY; other joints keep 0. "
          "Without it the constant beside the weights is handed over again")
      ->delimiter(',');
  command
      ->add_option("--at-most", arguments->at_most,
                   "Refuse more than this, JOINT=VALUE; for weights that saw one homing alone. "
                   "Never more than the homings of the training allow")
      ->delimiter(',');
  command
      ->add_option(
          "--when-s", arguments->when_s,
          "With --recording: the second of the reading begins so long after the first row; "
          "default: the last second")
      ->check(CLI::Range(0.0, 1e9));
  command->add_flag("--dry-run", arguments->is_dry, "Show the constant; write and ask nothing");
  command->add_flag("--force")->description("Replace what is no constant under the name of one");
  command->add_flag("--end", arguments->ends, "Take the constant away from the plugin");
  (void)add_load_options(*command, arguments->load);
  command->footer(
      "Every homing finds other zeros, which leave a constant error of each joint. The constant "
      "is\n"
      "pose - reading - what the weights predict there. It lies in WEIGHTS.homing.json; the "
      "weights\n"
      "and their signature stay as they are. The plugin takes it with the pedal up, for these\n"
      "weights and this homing alone, fades to it and drops it at the next homing. Move every "
      "joint\n"
      "to and fro before, as in work: weights remember the side of a play.\n"
      "Exit 1: refused, or not taken. Example, with the tool in a calibration pin:\n"
      "  ravencal rezero --weights arm.blob --name /ravencal-left --at "
      "shoulder=45deg+-0.05deg,elbow=90deg+-0.05deg");
  on_call(*command, exit_code,
          {.read = {"--weights", "--recording", "--profile"},
           .also_written = path_of_constant,
           .own = earlier_constant},
          [arguments, &exit_code] { return run(*arguments, exit_code); });
}

}  // namespace ravencal::commands
