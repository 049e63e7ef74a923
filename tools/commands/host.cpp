// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "exchange/load.hpp"
#include "host/flight_file.hpp"
#include "host/loop.hpp"
#include "host/replay.hpp"
#include "host/robot_source.hpp"
#include "host/summary.hpp"
#include "model/blob_writer.hpp"
#include "physics/plant.hpp"
#include "plugin_host/plugin_library.hpp"
#include "rezero/constant_file.hpp"

namespace ravencal::commands {
namespace {

constexpr double kRandomMotionS = 60.0;   // without a trajectory and a number of ticks
constexpr double kShortestMotionS = 1.0;  // of make_random

struct HostArguments {
  std::string plugin;
  std::string weights;
  std::string plant;
  std::string recording;
  std::string trajectory;
  std::string json;
  std::string telemetry;
  std::string constant;
  std::string flight = "ravencal_flight.csv";
  double payload_g = -1.0;  // negative: as the plant says
  double step_budget_us = 0.0;
  std::int64_t ticks = 0;  // 0: to the motion's end
  host::LoopOptions loop;
  host::TwinSourceOptions twin;
  record::LoadOptions load;
};

core::Result<std::unique_ptr<host::RobotSource>> make_twin(const HostArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(physics::Plant plant, physics::load_plant(arguments.plant));
  if (arguments.payload_g >= 0.0) plant.payload.mass_kg = arguments.payload_g / 1000.0;
  if (!arguments.trajectory.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory trajectory,
                              trajectory::read_for_plant(arguments.trajectory, plant));
    return host::make_twin_source(plant, trajectory, arguments.twin);
  }
  trajectory::RandomOptions random;
  random.seed = arguments.twin.seed;
  const double wanted_s = static_cast<double>(arguments.ticks) / plant.robot.control_rate_hz;
  random.duration_s = arguments.ticks == 0 ? kRandomMotionS : std::max(wanted_s, kShortestMotionS);
  RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory trajectory,
                            trajectory::make_random(random));
  return host::make_twin_source(plant, trajectory, arguments.twin);
}

/// The plugin's defaults, for weights of the source's arm, changed as the user wants.
core::Result<ravencal_config> make_config(const HostArguments& arguments,
                                          const plugin_host::Library& library,
                                          const host::RobotSource& source) {
  ravencal_config config = library.default_config(source.arm());
  config.step_budget_ns = static_cast<std::uint32_t>(arguments.step_budget_us * 1e3);
  if (arguments.telemetry.size() >= sizeof config.telemetry_name) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("--telemetry {}: at most {} characters", arguments.telemetry,
                                   sizeof config.telemetry_name - 1)};
  }
  std::memcpy(config.telemetry_name, arguments.telemetry.c_str(), arguments.telemetry.size() + 1);
  return config;
}

/// The plugin takes it where weights and homing are those of the constant.
core::Status offer(const std::string& path, const plugin_host::Instance& plugin) {
  RAVENCAL_ASSIGN_OR_RETURN(const rezero::ConstantFile file, rezero::read_constant(path));
  if (file.weights_checksum != plugin.info().checksum) {
    return core::data_error(
        fmt::format("{}: belongs to other weights (checksum {:08x}) than --weights ({:08x})", path,
                    file.weights_checksum, plugin.info().checksum));
  }
  const ravencal_homing_constant constant = rezero::for_plugin(file);
  return plugin.set_homing_constant(constant);
}

core::Result<host::Summary> run(const HostArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model,
                            model::read_blob(arguments.weights));
  RAVENCAL_ASSIGN_OR_RETURN(const plugin_host::Library library,
                            plugin_host::Library::open(arguments.plugin));
  record::Recording recording;
  std::unique_ptr<host::RobotSource> source;
  if (!arguments.recording.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(recording,
                              exchange::load_recording(arguments.recording, arguments.load));
    RAVENCAL_ASSIGN_OR_RETURN(source, host::make_recording_source(recording, model.features));
    if (source->skipped_ns() > 0) {
      core::remark("ravencal: warning: {}: {:.1f} s without a row are skipped\n", recording.source,
                   1e-9 * static_cast<double>(source->skipped_ns()));
    }
  } else {
    RAVENCAL_ASSIGN_OR_RETURN(source, make_twin(arguments));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const ravencal_config config, make_config(arguments, library, *source));
  RAVENCAL_ASSIGN_OR_RETURN(plugin_host::Instance plugin,
                            plugin_host::Instance::create(library, config));
  if (plugin_host::is_without_telemetry(config)) {
    core::remark(
        "ravencal host: warning: --telemetry {}: another user has this name, so that the plugin "
        "writes no telemetry; choose another one\n",
        arguments.telemetry);
  }
  RAVENCAL_RETURN_IF_ERROR(plugin.load(arguments.weights));
  if (!arguments.constant.empty()) RAVENCAL_RETURN_IF_ERROR(offer(arguments.constant, plugin));

  host::LoopOptions loop = arguments.loop;
  loop.ticks = arguments.ticks == 0 ? source->cycles() : arguments.ticks;
  cli::catch_interrupts();
  cli::Progress progress("host");
  host::Summary summary = host::run(loop, plugin, *source, model, [&](double done) {
    progress.update(done);
    return !cli::interrupted();
  });
  RAVENCAL_ASSIGN_OR_RETURN(summary.faults, host::write_flight(plugin, arguments.flight));
  if (summary.faults > 0) summary.flight_path = arguments.flight;
  if (!arguments.json.empty()) {
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(arguments.json, host::summary_json(summary)));
  }
  return summary;
}

/// The flight of a FAULT before this one.
cli::Paths earlier_flight(const CLI::App& command) {
  const std::filesystem::path path = cli::path_of(command, "--flight");
  return host::is_flight(path) ? cli::Paths{path} : cli::Paths();
}

/// Prints the figures. A correction that was never applied is a finding.
cli::ExitCode report(const host::Summary& summary) {
  core::say("{}", host::summary_text(summary));
  for (const learn::JointEvaluation& joint : summary.evaluation.joints) {
    if (!(joint.calibrated.rmse > joint.raw.rmse)) continue;
    core::remark(
        "ravencal: warning: joint {}: the correction makes the error larger: these weights "
        "do not fit this robot, plant or homing\n",
        joint.joint);
  }
  if (summary.corrected_ticks > 0) return cli::kOk;
  core::say("the correction was never applied in full: see the doubts above\n");
  return cli::kFinding;
}

}  // namespace

void add_host(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<HostArguments>();
  CLI::App* command =
      app.add_subcommand("host", "Run the plugin in a simulated 1 kHz loop of the robot");
  command->add_option("--plugin", arguments->plugin, "libravencal_plugin.so")->required();
  command->add_option("--weights", arguments->weights, "Weights (.blob)")->required();
  auto* source = command->add_option_group("robot", "Source of the robot's states");
  source->add_option("--plant", arguments->plant, "The digital twin of this plant (.toml), live");
  source->add_option("--recording", arguments->recording,
                     "A recording, each row held until the next, a second at most");
  source->require_option(1);
  command->add_option(
      "--trajectory", arguments->trajectory,
      "With --plant: CSV of `ravencal trajectory`; default: random motion, 60 s or --ticks");
  command->add_option("--payload-g", arguments->payload_g, "With --plant: weight at the tool, g")
      ->check(CLI::Range(0.0, 5000.0));
  command->add_option("--seed", arguments->twin.seed, "With --plant: disturbances, random motion")
      ->capture_default_str();
  command->add_option("--homing-seed", arguments->twin.homing_seed, "With --plant: homing")
      ->capture_default_str();
  (void)add_load_options(*command, arguments->load);
  command
      ->add_option("--rate-hz", arguments->loop.rate_hz,
                   "Wake-ups per second; each is 1 ms of the robot's time. 0: as fast as possible")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  command->add_option("--ticks", arguments->ticks, "Cycles to run; default: to the motion's end")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{100'000'000}));
  command
      ->add_option("--step-budget-us", arguments->step_budget_us,
                   "Longest step; more than two longer ones within 1000 end the correction (500 on "
                   "a robot). 0: no limit, because this machine is not the robot's")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_option("--constant", arguments->constant,
                      "Constant of a homing (WEIGHTS.homing.json of `ravencal rezero`); the plugin "
                      "takes it where weights and homing are its own");
  command->add_option("--telemetry", arguments->telemetry,
                      "Shared memory for `ravencal monitor`, like /ravencal-left");
  command
      ->add_option("--flight", arguments->flight,
                   "On a FAULT: CSV of the last 200 ticks before it, for the profile generic")
      ->capture_default_str();
  command->add_option("--json", arguments->json, "Write the figures to this file");
  command->footer(
      "The table counts the cycles in which the correction was applied in full.\n"
      "Exit 1 if there are none. Example:\n"
      "  ravencal host --plugin libravencal_plugin.so --weights W.blob --plant "
      "tools/plants/raven2.toml --trajectory test.csv --ticks 20000");
  on_call(*command, exit_code,
          {.read = {"--plugin", "--weights", "--constant", "--plant", "--recording", "--trajectory",
                    "--profile"},
           .written = {"--flight", "--json"},
           .own = earlier_flight,
           .together = true},
          [arguments, &exit_code]() -> core::Status {
            RAVENCAL_ASSIGN_OR_RETURN(const host::Summary summary, run(*arguments));
            exit_code = report(summary);
            return {};
          });
}

}  // namespace ravencal::commands
