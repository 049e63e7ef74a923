// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "exchange/load.hpp"
#include "physics/plant.hpp"
#include "record/recording_writer.hpp"
#include "simulation/follow.hpp"
#include "simulation/session.hpp"

namespace ravencal::commands {
namespace {

struct SimulateArguments {
  std::string plant;
  std::string trajectory;
  std::string follow;
  std::string out;
  std::string edges;
  double payload_g = -1.0;  // negative: as the plant says
  double rate_hz = 0.0;     // 0: as the plant says
  bool json = false;
  simulation::SessionOptions session;
  simulation::FollowOptions following;
  record::LoadOptions load;
};

void print_followed(const simulation::FollowResult& followed, const SimulateArguments& arguments) {
  if (arguments.json) {
    nlohmann::json joints = nlohmann::json::array();
    for (const auto& joint : followed.joints) {
      joints.push_back({{"joint", joint.joint}, {"how", joint.how}, {"rmse", joint.rmse_ji}});
      if (joint.drawn_constant_ji) joints.back()["drawn_constant"] = *joint.drawn_constant_ji;
    }
    const nlohmann::json json = {
        {"file", arguments.out}, {"rows", followed.recording.rows()}, {"joints", joints}};
    core::say("{}\n", json.dump());
    return;
  }
  core::say("{}: {} rows\n", arguments.out, followed.recording.rows());
  for (const auto& joint : followed.joints) {
    core::say("  {:<12} {}; {:.4g} (rad or m) from the recording{}\n", joint.joint, joint.how,
              joint.rmse_ji,
              joint.drawn_constant_ji
                  ? fmt::format(", beside the constant of {:.4g} that homing draws",
                                *joint.drawn_constant_ji)
                  : std::string());
  }
}

/// Any plant along a recording of its robot.
core::Status follow(const SimulateArguments& arguments, const physics::Plant& plant) {
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            exchange::load_recording(arguments.follow, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(const simulation::FollowResult followed,
                            simulation::follow_recording(plant, recording, arguments.following));
  RAVENCAL_RETURN_IF_ERROR(record::write_recording(followed.recording, arguments.out, true));
  print_followed(followed, arguments);
  return {};
}

void print_summary(const simulation::SessionSummary& summary, const SimulateArguments& arguments,
                   double wall_s) {
  const double factor = summary.simulated_s / wall_s;
  if (arguments.json) {
    const nlohmann::json json = {{"file", arguments.out},
                                 {"rows", summary.rows},
                                 {"homings", summary.homings},
                                 {"simulated_s", summary.simulated_s},
                                 {"wall_s", wall_s},
                                 {"times_real_time", factor},
                                 {"interrupted", summary.interrupted},
                                 {"led_by_simulation", summary.led}};
    core::say("{}\n", json.dump());
    return;
  }
  core::say(
      "{}: {} rows, {} homing(s), {:.0f} s simulated in {:.1f} s ({:.0f} times real time){}\n",
      arguments.out, summary.rows, summary.homings, summary.simulated_s, wall_s, factor,
      summary.interrupted ? "; stopped early, as its last event says" : "");
  if (!summary.led.empty())
    core::say(
        "note: the plant states no [joint.controller] of {}: led by servos whose gains their "
        "inertia gives\n",
        fmt::join(summary.led, ", "));
}

core::Status run(const SimulateArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(physics::Plant plant, physics::load_plant(arguments.plant));
  if (arguments.payload_g >= 0.0) plant.payload.mass_kg = arguments.payload_g / 1000.0;
  if (!arguments.follow.empty()) return follow(arguments, plant);
  if (arguments.trajectory.empty()) {
    return core::Error{core::ErrorCode::kUsage,
                       "give --trajectory (a motion of its own) or --follow (a recording)"};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory trajectory,
                            trajectory::read_for_plant(arguments.trajectory, plant));
  simulation::SessionOptions session = arguments.session;
  if (arguments.rate_hz > 0.0) session.rate_hz = arguments.rate_hz;
  if (!arguments.edges.empty()) session.edges = arguments.edges;
  session.trajectory_name = std::filesystem::path(arguments.trajectory).filename().string();
  cli::catch_interrupts_of_work();
  cli::Progress progress("simulate");
  const auto start = std::chrono::steady_clock::now();
  const auto look = [&](double done) {
    progress.update(done);
    return !cli::interrupted();
  };
  RAVENCAL_ASSIGN_OR_RETURN(
      const simulation::SessionSummary summary,
      simulation::record_session(plant, trajectory, arguments.out, session, look));
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  print_summary(summary, arguments, wall.count());
  return {};
}

}  // namespace

void add_simulate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  simulation::SessionOptions& session = arguments->session;
  CLI::App* command =
      app.add_subcommand("simulate", "Simulate a plant along a trajectory or a recording");
  command
      ->add_option("--plant", arguments->plant, "The robot (.toml), e.g. tools/plants/raven2.toml")
      ->required();
  CLI::Option* trajectory = command->add_option("--trajectory", arguments->trajectory,
                                                "CSV of `ravencal trajectory` or `suggest`, with a "
                                                "column of each joint of the plant");
  CLI::Option* recording = command->add_option("--follow", arguments->follow,
                                               "Recording whose commands (desired positions, "
                                               "efforts, believed positions, loads) go into any "
                                               "plant; OUT has the same channels, simulated");
  recording->excludes(trajectory);
  for (CLI::Option* const option : add_load_options(*command, arguments->load))
    option->needs(recording);
  command
      ->add_option(
          "--restart-s", arguments->following.restart_s,
          "Time after which a drive under recorded efforts restarts from the recorded state")
      ->check(CLI::Range(0.01, 1e6))
      ->needs(recording)
      ->capture_default_str();
  command
      ->add_flag("--open-loop", arguments->following.open_loop,
                 "Apply recorded efforts although the plant's controller could close the loop")
      ->needs(recording);
  command->add_option("--out", arguments->out, "Recording to create (.db)")->required();
  command->add_option(
      "--edges", arguments->edges,
      "File (.db) for every edge of the external encoders, on a clock of its own, for "
      "`ravencal-encoders --replay`. OUT then holds no truth; `ravencal merge` adds it");
  command->add_option("--seed", session.seed, "Seed of the disturbances during the run")
      ->capture_default_str();
  command
      ->add_option("--homing-seed", session.homing_seed,
                   "Seed of power-on and homing; equal numbers are one session without re-homing")
      ->capture_default_str();
  command
      ->add_option("--payload-g", arguments->payload_g,
                   "Weight at the tool carriage, g (paper: 0, 500)")
      ->check(CLI::Range(0.0, 5000.0));
  command
      ->add_option("--rate-hz", arguments->rate_hz,
                   "Rows per second; default: the plant's logger (100)")
      ->check(CLI::Range(0.001, 1e6));
  command
      ->add_option("--rehome-every-s", session.rehome_every_s,
                   "Time between homings; 0: only at the start")
      ->check(cli::not_negative());
  command
      ->add_option("--rehomings", session.rehomings,
                   "Further homings in the same session before recording starts")
      ->check(CLI::Range(0U, 1000U));
  command->add_flag("--drift", session.drift, "Add the slow thermal drift of hours of warm-up");
  session.overwrite = true;  // what core/outputs.hpp lets
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->footer(
      "A plant of three joints with [joint.controller] and [joint.homing] is a RAVEN arm: its "
      "twin homes, draws disturbances and writes the robot's messages. --edges, --rehome-every-s, "
      "--rehomings and --drift are the twin's, and so are the seeds; other plants draw nothing.\n"
      "The twin is a stand-in: its cables are tuned to published error sizes, see the plant file.\n"
      "Example: ravencal simulate --plant tools/plants/raven2.toml --trajectory zigzag3.csv --out "
      "zigzag3.db\n"
      "         ravencal simulate --plant arm7.toml --trajectory sweeps.csv --out sweeps.db\n"
      "         ravencal simulate --plant diagnosis/plant_improved.toml --follow run.csv --profile "
      "tools/profiles/emps.toml --out again.db");
  on_call(*command, exit_code,
          {.read = {"--plant", "--trajectory", "--follow", "--profile"},
           .written = {"--out", "--edges"},
           .together = true},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
