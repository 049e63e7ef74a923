// SPDX-License-Identifier: Apache-2.0
#include "learn/train.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "choice/choice_table.hpp"
#include "choice/choose.hpp"
#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "cli/words.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/network_options.hpp"
#include "commands/origin_options.hpp"
#include "commands/same_seed_option.hpp"
#include "commands/session_option.hpp"
#include "core/terminal.hpp"
#include "exchange/load.hpp"
#include "learn/calibration_report.hpp"
#include "learn/distinct.hpp"
#include "learn/ensemble.hpp"
#include "learn/evaluate.hpp"
#include "learn/expectation.hpp"
#include "learn/onnx_file.hpp"
#include "learn/recordings_at_hook.hpp"
#include "loop/margins.hpp"
#include "model/feature_matrix.hpp"
#include "model/loop_text.hpp"
#include "physics/plant.hpp"
#include "report/report.hpp"
#include "simulation/workspace.hpp"

namespace ravencal::commands {
namespace {

constexpr const char* kAuto = "auto";
constexpr const char* kNetwork = "network";

struct TrainArguments {
  std::vector<std::string> recordings;
  std::vector<std::string> validation;
  std::string out;
  std::string report;
  std::string physics;
  std::string plant;
  std::uint32_t networks = 1;
  std::string isa;
  std::string method;
  bool same_seed = false;
  OriginOptions origin;
  record::LoadOptions load;
  learn::TrainOptions train;
  choice::SessionRule sessions = choice::SessionRule::kAuto;
};

/// Options that say how a network is made and trained.
constexpr std::array kNetworkOptions = {
    "--hidden",   "--activation", "--history",     "--play",          "--loop-noise",
    "--ridge",    "--epochs",     "--batch",       "--learning-rate", "--penalty-scale",
    "--networks", "--physics",    "--history-step"};

/// The method that was given; without one a network where its options are given, else a choice.
core::Result<std::string> method_of(const CLI::App& command, const std::string& given) {
  const auto option = std::find_if(kNetworkOptions.begin(), kNetworkOptions.end(),
                                   [&](const char* name) { return command.count(name) > 0; });
  const bool is_network = given == kNetwork || (given.empty() && option != kNetworkOptions.end());
  if (is_network && command.count("--session") > 0) {
    return core::usage_error(
        "--session: a network of --hidden has one constant for all sessions; leave it out");
  }
  if (is_network) return std::string(kNetwork);
  if (option == kNetworkOptions.end()) return given.empty() ? kAuto : given;
  return core::usage_error(
      fmt::format("{}: --method {} has no such setting; leave it out, or give --method network",
                  *option, given));
}

core::Status complete(TrainArguments& arguments) {
  if (!arguments.isa.empty()) {
    const auto isa = learn::isa_from(arguments.isa);
    if (!isa || !learn::is_supported(*isa))
      return core::usage_error(
          fmt::format("--isa {}: this processor or build lacks it; the best here is {}",
                      arguments.isa, learn::name_of(learn::best_isa())));
    arguments.train.trainer.isa = *isa;
  }
  return {};
}

/// One line of progress per epoch.
void show_epoch(cli::Progress& progress, double done, const learn::EpochReport& epoch) {
  std::string detail = fmt::format("epoch {}, loss {:.5f}, with penalties {:.5f}", epoch.epoch,
                                   epoch.training, epoch.training + epoch.penalty);
  if (epoch.validation == epoch.validation) {
    detail += fmt::format(", held out {:.5f}{}", epoch.validation, epoch.best ? " (best)" : "");
  }
  progress.update(done, detail);
}

/// A model, however it was found.
struct Trained {
  model::CalibrationModel model;
  std::size_t rows = 0;
  std::vector<learn::EpochReport> epochs;  ///< of a network
  std::uint32_t kept_epoch = 0;
  std::vector<std::string> warnings;
  std::string course;        ///< what was tried; may be empty
  std::string interruption;  ///< what the model is in spite of it; empty: not interrupted
};

core::Status write_report(const TrainArguments& arguments, const Trained& trained,
                          const learn::Evaluation& evaluation, const std::string& title) {
  RAVENCAL_RETURN_IF_ERROR(report::write_html(
      learn::make_report(trained.model, evaluation, title, trained.epochs, trained.kept_epoch),
      arguments.report));
  core::say("report: {}\n", arguments.report);
  return {};
}

/// What the plant knows: recordings of its simulation over the workspace.
core::Result<std::vector<record::Recording>> simulated(const std::string& plant_file,
                                                       double row_period_s) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(plant_file));
  if (!simulation::simulation_runs(plant)) {
    return core::usage_error(fmt::format(
        "--physics {}: the twin cannot run this plant: it takes three joints, each with "
        "controller and homing",
        plant_file));
  }
  cli::Progress progress("simulate");
  return simulation::simulated_over_workspace(plant, row_period_s, [&](double done) {
    progress.update(done, plant_file);
    return !cli::interrupted();
  });
}

using Recordings = std::vector<record::Recording>;

core::Result<Trained> train_network(TrainArguments& arguments, const Recordings& training,
                                    const Recordings& held_out) {
  Recordings simulation;
  if (!arguments.physics.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(simulation,
                              simulated(arguments.physics, model::row_period_s(training.front())));
  }
  arguments.train.simulated = pointers_to(simulation);
  cli::Progress progress("train");
  std::uint32_t each = arguments.train.trainer.epochs;
  if (!simulation.empty()) each += arguments.train.simulated_trainer.epochs;
  const double epochs = static_cast<double>(each) * arguments.networks;
  double finished = 0.0;
  RAVENCAL_ASSIGN_OR_RETURN(
      learn::TrainResult result,
      learn::train_ensemble(pointers_to(training), pointers_to(held_out), arguments.train,
                            arguments.networks, [&](const learn::EpochReport& epoch) {
                              show_epoch(progress, ++finished / epochs, epoch);
                              return !cli::interrupted();
                            }));
  if (!simulation.empty()) {
    result.model.provenance["physics"] =
        fmt::format("base: {}, simulated over the workspace under {} loads", arguments.physics,
                    simulation.size());
  }
  Trained trained{std::move(result.model),
                  result.rows,
                  std::move(result.epochs),
                  result.kept_epoch,
                  std::move(result.warnings),
                  {},
                  {}};
  if (result.interrupted && result.kept_epoch == 0)
    return core::usage_error("stopped before the first epoch was over; nothing was written");
  if (result.interrupted) {
    trained.interruption =
        fmt::format("the {} epoch, {} of {}", held_out.empty() ? "last finished" : "best",
                    trained.kept_epoch, arguments.train.trainer.epochs);
  }
  return trained;
}

core::Result<Trained> choose(const TrainArguments& arguments, const Recordings& training) {
  choice::ChoiceOptions options;
  options.kinds = arguments.method == "linear"  ? choice::Kinds::kLinear
                  : arguments.method == "units" ? choice::Kinds::kUnits
                                                : choice::Kinds::kAll;
  options.features = arguments.train.features;
  options.joints = arguments.train.joints;
  options.origin = arguments.train.origin;
  options.at_hook = learn::is_at_hook(arguments.train.latched, training.front());
  options.seed = arguments.train.trainer.seed;
  options.sessions = arguments.sessions;
  cli::Progress progress("train");
  RAVENCAL_ASSIGN_OR_RETURN(choice::Choice chosen,
                            choice::choose_model(pointers_to(training), options,
                                                 [&](double done, const std::string& candidate) {
                                                   progress.update(done, candidate);
                                                   return !cli::interrupted();
                                                 }));
  Trained trained;
  trained.course = choice::choice_table(chosen);
  trained.rows = static_cast<std::size_t>(chosen.rows.rows());
  trained.model = std::move(chosen.model);
  trained.warnings = std::move(chosen.warnings);
  if (chosen.interrupted) trained.interruption = "the best of the candidates that were tried";
  return trained;
}

std::string title_of_shown(const TrainArguments& arguments, bool held_out) {
  if (!held_out) return "training recordings (not a test)";
  return arguments.method == kNetwork ? "validation recordings (chose the epoch)"
                                      : "validation recordings (chose nothing)";
}

/// What was cut short says so and replaces nothing.
core::Status write_model(Trained& trained, const std::string& out) {
  if (trained.interruption.empty()) return learn::write_onnx(trained.model, out);
  std::error_code unknown;
  if (std::filesystem::is_regular_file(out, unknown))
    return core::usage_error(
        fmt::format("{}: stopped early, so that the file stays as it was", out));
  trained.model.provenance["interrupted"] = trained.interruption;
  RAVENCAL_RETURN_IF_ERROR(learn::write_onnx(trained.model, out));
  core::say("interrupted: {} holds {}\n", out, trained.interruption);
  return {};
}

core::Status run(TrainArguments arguments) {
  RAVENCAL_RETURN_IF_ERROR(complete(arguments));
  RAVENCAL_RETURN_IF_ERROR(learn::check_distinct(arguments.recordings, arguments.validation));
  RAVENCAL_ASSIGN_OR_RETURN(auto training,
                            exchange::load_recordings(arguments.recordings, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(auto held_out,
                            exchange::load_recordings(arguments.validation, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(const auto implausible, warn_of_implausible(pointers_to(training)));
  RAVENCAL_RETURN_IF_ERROR(warn_of_implausible(pointers_to(held_out)));
  const learn::SharedSeeds shared =
      learn::shared_seeds(learn::seeds_of(pointers_to(training)), pointers_to(held_out));
  if (!arguments.same_seed) RAVENCAL_RETURN_IF_ERROR(learn::check_run_seeds(shared));
  cli::catch_interrupts_of_work();
  RAVENCAL_ASSIGN_OR_RETURN(Trained trained, arguments.method == kNetwork
                                                 ? train_network(arguments, training, held_out)
                                                 : choose(arguments, training));
  print_warnings(trained.warnings);
  learn::keep_with(trained.model, implausible);
  std::optional<loop::Margins> margins;
  if (!arguments.plant.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.plant));
    RAVENCAL_ASSIGN_OR_RETURN(margins,
                              loop::margins_with(plant, trained.model, pointers_to(training)));
  }
  RAVENCAL_RETURN_IF_ERROR(write_model(trained, arguments.out));
  const auto& shown = held_out.empty() ? training : held_out;
  const std::string title = title_of_shown(arguments, !held_out.empty());
  RAVENCAL_ASSIGN_OR_RETURN(learn::Evaluation evaluation,
                            learn::evaluate(trained.model, pointers_to(shown)));
  evaluation.shared = shared;
  print_warnings(learn::warnings_of(evaluation));
  core::say("{}{}: {} features, {} rows; {}:\n{}{}", trained.course, arguments.out,
            trained.model.features.size(), trained.rows, title, learn::evaluation_table(evaluation),
            learn::expectation_table(evaluation, false));
  print_origin(trained.model);
  core::say("{}", model::loop_text(trained.model));
  if (margins) core::say("{}", loop::describe(*margins));
  if (arguments.report.empty()) return {};
  return write_report(arguments, trained, evaluation, title);
}

void add_data_options(CLI::App& command, TrainArguments& arguments) {
  command.add_option("recordings", arguments.recordings, "Recordings to train on (.db, .csv)")
      ->required();
  command.add_option("--out", arguments.out, "Model to write (.onnx)")->required();
  command.add_option("--validate", arguments.validation,
                     "Held-out recordings that choose the epoch; never the test set");
  add_same_seed_option(command, arguments.same_seed);
  command.add_option("--report", arguments.report, "HTML page to write");
  command
      .add_option("--method", arguments.method,
                  "auto: compare candidates on held-out parts of the training and take the best of "
                  "each joint; linear, units: only candidates that are linear, or that have random "
                  "units; network: one network of --hidden. Default: auto, or network where an "
                  "option of the network is given")
      ->check(CLI::IsMember({kAuto, "linear", "units", kNetwork}));
  (void)add_load_options(command, arguments.load);
  add_origin_options(command, arguments.origin);
  add_joints_option(command, arguments.train.joints);
  add_session_option(command, arguments.sessions);
}

void add_physics_option(CLI::App& command, TrainArguments& arguments) {
  command.add_option(
      "--physics", arguments.physics,
      "A plant (plant_improved.toml of `ravencal diagnose`). The twin simulates it over the whole "
      "workspace with 0, 250 and 500 g. A first network learns the simulated error, the network of "
      "--hidden learns the recorded error that remains, and their sum is one ordinary model");
}

void add_network_options(CLI::App& command, TrainArguments& arguments) {
  learn::TrainOptions& train = arguments.train;
  command.add_option("--features", train.features,
                     "paper112, notebook208, light, light-open (no input depends on the motor "
                     "command, so no loop is closed), group:G, joint:J, NAME, jpos.*, NAME@ROWS, "
                     "NAME~HALF_WIDTH, NAME%SECONDS (exponential mean), NAME%absSECONDS (mean of "
                     "the absolute value), NAME%LENGTH:POSITION and NAME%absLENGTH:POSITION (the "
                     "same over the travel of POSITION), -TERM; separated by commas");
  command.add_option("--history", train.history, "Past copies of each feature")
      ->check(CLI::Range(0, 1000));
  command.add_option("--history-step", train.history_step, "Rows between past copies")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command
      .add_option("--play", train.play,
                  "Add play operators of these half-widths (SI units) of every position")
      ->check(cli::positive())
      ->delimiter(',');
  cli::add_words<learn::Latched>(
      command, "--latched", train.latched,
      {{"auto", learn::Latched::kAuto}, {"on", learn::Latched::kOn}, {"off", learn::Latched::kOff}},
      "Take torque, DAC, desired values and pose from the control cycle before, as the plugin sees "
      "them; auto: where the recording has every cycle");
  add_hidden_or_none_option(command, train.hidden);
  add_activation_option(command, train.activation);
  command
      .add_option("--loop-noise", train.loop_noise,
                  "Training noise, in standard deviations of each input, on inputs that answer to "
                  "the motor command (torque, velocity, desired position). It keeps the gain of "
                  "the loop through the correction small")
      ->check(CLI::Range(0.0, 100.0));
  command.add_option("--plant", arguments.plant,
                     "Plant (.toml) with the servo for the margins of the loop; `convert --plant` "
                     "refuses a gain margin below 2 or a phase margin below 45 deg");
  command.add_option("--ridge", train.ridge, "Linear regression: penalty on squared weights")
      ->check(cli::not_negative());
}

void add_optimiser_options(CLI::App& command, learn::TrainerSettings& trainer) {
  add_epoch_options(command, trainer.epochs, trainer.batch);
  add_learning_rate_option(command, trainer.adam.learning_rate);
  command
      .add_option_function<double>(
          "--penalty-scale",
          [&trainer](double scale) {
            learn::Penalties& penalties = trainer.penalties;
            penalties.l1_weights *= scale;
            penalties.l2_weights *= scale;
            penalties.l2_biases *= scale;
            penalties.l2_activity *= scale;
          },
          "Multiplies the paper's L1 and L2 penalties")
      ->check(cli::not_negative());
  command.add_option("--seed", trainer.seed, "Seed of weights and shuffles")->capture_default_str();
  command
      .add_option("--threads", trainer.threads,
                  "Threads; 0: as many as are useful; changes no result")
      ->check(CLI::Range(0U, 1024U));
}

}  // namespace

void add_train(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<TrainArguments>();
  CLI::App* command = app.add_subcommand("train", "Learn the joint error from recordings");
  add_data_options(*command, *arguments);
  add_network_options(*command, *arguments);
  add_physics_option(*command, *arguments);
  add_optimiser_options(*command, arguments->train.trainer);
  add_networks_option(*command, arguments->networks);
  command
      ->add_option("--isa", arguments->isa,
                   "Instruction set of the kernels; it decides the last bits of the result")
      ->check(CLI::IsMember({"baseline", "avx2", "avx512"}));
  command->footer(
      "Example: ravencal train run*.db --out arm.onnx --report train.html\n"
      "         ravencal train run1.db run2.db --validate run3.db --features light "
      "--hidden 128,64,32 --out arm.onnx\n"
      "         ravencal train run*.db --validate run3.db --features light-open --plant "
      "raven2.toml --out arm.onnx");
  on_call(*command, exit_code,
          {.read = {"recordings", "--validate", "--physics", "--plant", "--profile"},
           .written = {"--out", "--report"},
           .together = true},
          [arguments, command]() -> core::Status {
            RAVENCAL_ASSIGN_OR_RETURN(arguments->method, method_of(*command, arguments->method));
            arguments->train.origin = given_origin(*command, arguments->origin);
            return run(*arguments);
          });
}

}  // namespace ravencal::commands
