// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/numbers.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "exchange/load.hpp"
#include "record/alignment.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::commands {
namespace {

struct MergeArguments {
  std::string robot;
  std::string truth;
  std::string out;
  std::string clock = "find";
  std::optional<double> delay_ms;
  std::string truth_profile;
  double largest_delay_ms = 100.0;
  double longest_gap_ms = 50.0;
  bool json = false;
  record::LoadOptions load;
};

record::MergeOptions options_of(const MergeArguments& arguments) {
  record::MergeOptions options;
  if (arguments.clock == "same") options.clock = record::RobotClock::kSame;
  if (arguments.clock == "wall") options.clock = record::RobotClock::kWall;
  if (arguments.delay_ms) options.fixed_delay_s = 1e-3 * *arguments.delay_ms;
  options.delay.largest_s = 1e-3 * arguments.largest_delay_ms;
  options.longest_gap_ns = std::llround(1e6 * arguments.longest_gap_ms);
  return options;
}

void print_json(const MergeArguments& arguments, const record::Merged& merged) {
  nlohmann::ordered_json json = {{"file", arguments.out},
                                 {"rows", merged.recording.rows()},
                                 {"rows_with_truth", merged.rows_with_truth},
                                 {"delay_s", merged.delay_s},
                                 {"delay", arguments.delay_ms ? "given" : "estimated"}};
  json["estimate"] = nullptr;
  if (merged.estimate) {
    json["estimate"] = {{"delay_s", merged.estimate->delay_s},
                        {"sigma_s", merged.estimate->sigma_s},
                        {"correlation", merged.estimate->correlation}};
  }
  json["clock"] = nullptr;
  if (merged.clock) {
    json["clock"] = {{"wall_minus_truth_clock_ns", merged.clock->offset_ns},
                     {"drift_ppm", merged.clock->drift_ppm},
                     {"largest_residual_ns", merged.clock->residual_ns}};
  }
  for (const auto& joint : merged.joints)
    json["joints"].push_back({{"joint", joint.name}, {"rows_with_truth", joint.rows_with_truth}});
  core::say("{}\n", json.dump());
}

void print_words(const MergeArguments& arguments, const record::Merged& merged) {
  if (merged.clock) {
    core::say("clocks: wall time through {:.3f} s, drift {:+.2f} ppm, line to {:.1f} us\n",
              1e-9 * static_cast<double>(merged.clock->offset_ns), merged.clock->drift_ppm,
              1e-3 * merged.clock->residual_ns);
  } else {
    core::say("clocks: one clock stamped both\n");
  }
  if (merged.estimate) {
    core::say("velocities: truth {:+.3f} +- {:.3f} ms behind the robot (correlation {:.4f})\n",
              1e3 * merged.estimate->delay_s, 1e3 * merged.estimate->sigma_s,
              merged.estimate->correlation);
  }
  core::say("delay taken out: {:+.3f} ms, {}\n", 1e3 * merged.delay_s,
            arguments.delay_ms ? "as given" : "as estimated");
  const auto rows = merged.recording.rows();
  core::say("{}: {} rows, {} with truth of every joint\n", arguments.out, rows,
            merged.rows_with_truth);
  for (const auto& joint : merged.joints) {
    if (joint.rows_with_truth == rows) continue;
    core::say("{}: {} rows without truth{}\n", joint.name, rows - joint.rows_with_truth,
              joint.rows_with_truth == 0 ? "; was the joint homed?" : "");
  }
}

core::Status run(const MergeArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording robot,
                            exchange::load_recording(arguments.robot, arguments.load));
  record::LoadOptions truth_load = arguments.load;
  truth_load.profile = arguments.truth_profile;
  truth_load.range = {};  // of the robot's rows; those of the truth follow from them
  if (truth_load.profile.empty() && std::filesystem::path(arguments.truth).extension() == ".bag")
    truth_load.profile = "raven2-bag-truth";
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording truth,
                            exchange::load_recording(arguments.truth, truth_load));
  RAVENCAL_ASSIGN_OR_RETURN(const record::Merged merged,
                            record::merge_truth(robot, truth, options_of(arguments)));
  RAVENCAL_RETURN_IF_ERROR(warn_of_implausible({&merged.recording}));
  RAVENCAL_RETURN_IF_ERROR(record::write_recording(merged.recording, arguments.out, true));
  if (arguments.json) {
    print_json(arguments, merged);
  } else {
    print_words(arguments, merged);
  }
  return {};
}

}  // namespace

void add_merge(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<MergeArguments>();
  CLI::App* command = app.add_subcommand("merge", "Add true joint positions to a robot's states");
  command->add_option("robot", arguments->robot, "Recording of the robot's states")->required();
  command
      ->add_option("truth", arguments->truth,
                   "Recording of `ravencal-encoders`, or a .bag with ext_jpos")
      ->required();
  command->add_option("--out", arguments->out, "Recording to create (.db)")->required();
  command
      ->add_option("--clock", arguments->clock,
                   "Clock of the robot's stamps: the truth's (same), the wall clock as in ROS "
                   "(wall), or the one under which both overlap (find)")
      ->check(CLI::IsMember({"find", "same", "wall"}))
      ->capture_default_str();
  command
      ->add_option("--delay-ms", arguments->delay_ms,
                   "How much later than the robot's the truth's stamps are, e.g. 0 if the kernel "
                   "stamped its edges; default: estimated from the velocities of both")
      ->check(CLI::Range(-1e6, 1e6));
  command->add_option("--largest-delay-ms", arguments->largest_delay_ms, "Search within +- this")
      ->check(CLI::Range(1.0, 10'000.0))
      ->capture_default_str();
  command
      ->add_option("--longest-gap-ms", arguments->longest_gap_ms,
                   "Truth is not interpolated across more than this")
      ->check(cli::positive())
      ->capture_default_str();
  (void)add_load_options(*command, arguments->load);
  command->add_option("--truth-profile", arguments->truth_profile,
                      "For a TRUTH that is no recording yet, as --profile is for ROBOT");
  command->add_flag("--force,--overwrite")->description("Replace a recording of that name");
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->footer(
      "The estimate contains the lag of the joint behind the motor, some ms.\n"
      "Give the delay if you know it.\n"
      "Example: ravencal merge run3.robot.db run3.db --out run3.merged.db");
  on_call(*command, exit_code,
          {.read = {"robot", "truth", "--profile", "--truth-profile"}, .written = {"--out"}},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
