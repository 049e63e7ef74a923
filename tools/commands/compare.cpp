// SPDX-License-Identifier: Apache-2.0
#include "study/compare.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/network_options.hpp"
#include "commands/same_seed_option.hpp"
#include "commands/study_run.hpp"
#include "core/terminal.hpp"
#include "core/version.hpp"
#include "exchange/load.hpp"
#include "host/loop.hpp"
#include "host/robot_source.hpp"
#include "host/summary.hpp"
#include "learn/distinct.hpp"
#include "learn/file_hash.hpp"
#include "model/blob_writer.hpp"
#include "plugin_host/plugin_library.hpp"
#include "study/compare_tables.hpp"

namespace ravencal::commands {
namespace {

struct CompareArguments {
  std::vector<std::string> train;
  std::map<std::string, std::vector<std::string>> sets = {{"test", {}}};
  std::string test_profile;
  std::vector<std::string> features_of;
  std::string plugin;
  std::int64_t ticks = 10000;
  record::LoadOptions load;
  study::CompareOptions options;
};

core::Status complete(CompareArguments& a) {
  for (const std::string& text : a.features_of) {
    const auto at = text.find('=');
    if (at == std::string::npos || at == 0)
      return core::usage_error(fmt::format("--features-of {}: write JOINT=FEATURES", text));
    a.options.features_of[text.substr(0, at)] = text.substr(at + 1);
  }
  for (const double share : a.options.shares) {
    if (!(share > 0.0) || share >= 1.0)
      return core::usage_error(fmt::format(
          "--shares {}: a share lies between 0 and 1; the whole training is always added", share));
  }
  std::sort(a.options.shares.begin(), a.options.shares.end());
  return {};
}

/// Two profiles may take different rows of one file.
core::Status tests_are_unseen(const CompareArguments& a) {
  if (!a.test_profile.empty()) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const auto trained, learn::hashed(a.train));
  for (const auto& [set, paths] : a.sets) {
    for (const std::string& tested : paths) {
      if (is_among(tested, a.train))
        return core::usage_error(fmt::format("{}: is both trained on and tested on", tested));
    }
    RAVENCAL_ASSIGN_OR_RETURN(const auto seen, learn::hashed(paths));
    RAVENCAL_RETURN_IF_ERROR(learn::check_unseen(trained, seen));
  }
  return {};
}

/// Names and hashes of files, as results depend on them.
core::Result<std::string> files_text(const std::vector<std::string>& paths) {
  std::vector<std::string> words;
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, learn::sha256_of_file(path));
    words.push_back(
        fmt::format("{} sha256:{}", std::filesystem::path(path).filename().string(), hash));
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

core::Status add_facts(CompareArguments& a) {
  auto& facts = a.options.facts;
  facts.emplace_back("version", core::kVersion);
  RAVENCAL_ASSIGN_OR_RETURN(std::string train, files_text(a.train));
  facts.emplace_back("trained on", std::move(train));
  for (const auto& [name, paths] : a.sets) {
    if (paths.empty()) continue;
    RAVENCAL_ASSIGN_OR_RETURN(std::string files, files_text(paths));
    facts.emplace_back("set " + name, std::move(files));
  }
  facts.emplace_back("profile", a.load.profile.empty()
                                    ? "of the recordings"
                                    : std::filesystem::path(a.load.profile).filename().string());
  facts.emplace_back("features", a.options.features.empty() ? "(default)" : a.options.features);
  facts.emplace_back("play half-widths", fmt::format("{}", fmt::join(a.options.play, ", ")));
  facts.emplace_back("seed", fmt::format("{}", a.options.settings.seed));
  if (a.options.settings.physics.empty()) return {};
  for (const char* file : {"plant_improved.toml", "report.json"}) {
    const std::string path = (a.options.settings.physics / file).string();
    RAVENCAL_ASSIGN_OR_RETURN(std::string hash, files_text({path}));
    facts.emplace_back(std::string("physics, ") + file, std::move(hash));
  }
  return {};
}

/// Runs the model in the host's loop on the first test recording.
core::Result<study::LoopFitness> measure(const CompareArguments& a,
                                         const record::Recording& recording,
                                         const model::CalibrationModel& model) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto source,
                            host::make_recording_source(recording, model.features));
  const std::filesystem::path blob = a.options.out / "models" / "measured.blob";
  RAVENCAL_RETURN_IF_ERROR(model::write_blob(model, blob));
  std::error_code ignored;
  const auto run = [&]() -> core::Result<study::LoopFitness> {
    RAVENCAL_ASSIGN_OR_RETURN(const plugin_host::Library library,
                              plugin_host::Library::open(a.plugin));
    ravencal_config config = library.default_config();
    config.step_budget_ns = 0;  // This machine is not the robot's; the time is what is asked for.
    RAVENCAL_ASSIGN_OR_RETURN(plugin_host::Instance plugin,
                              plugin_host::Instance::create(library, config));
    RAVENCAL_RETURN_IF_ERROR(plugin.load(blob));
    plugin.api().enable(plugin.get(), 1);
    host::LoopOptions loop;
    loop.ticks = std::min(a.ticks, source->cycles());
    const host::LoopResult result =
        host::run_loop(loop, plugin, *source, [](double) { return !cli::interrupted(); });
    const host::Summary summary = host::summarise(result, loop, plugin, model);
    study::LoopFitness fitness;
    fitness.loadable = true;
    fitness.measured = true;
    fitness.real_time = summary.real_time;
    fitness.step = {summary.step_ns.p50 * 1e-3, summary.step_ns.p99 * 1e-3,
                    summary.step_ns.p999 * 1e-3};
    return fitness;
  };
  auto fitness = run();
  std::filesystem::remove(blob, ignored);
  return fitness;
}

core::Status run(CompareArguments a) {
  RAVENCAL_RETURN_IF_ERROR(complete(a));
  RAVENCAL_RETURN_IF_ERROR(tests_are_unseen(a));
  RAVENCAL_RETURN_IF_ERROR(add_facts(a));
  std::vector<std::vector<record::Recording>> kept;  // owns what `data` points to
  kept.reserve(1 + a.sets.size());
  study::CompareData data;
  RAVENCAL_ASSIGN_OR_RETURN(auto train, exchange::load_recordings(a.train, a.load));
  kept.push_back(std::move(train));
  data.train = pointers_to(kept.back());
  record::LoadOptions test_load = a.load;
  if (!a.test_profile.empty()) test_load.profile = a.test_profile;
  for (const auto& [name, paths] : a.sets) {
    if (paths.empty()) continue;
    RAVENCAL_ASSIGN_OR_RETURN(auto recordings, exchange::load_recordings(paths, test_load));
    kept.push_back(std::move(recordings));
    data.sets[name] = pointers_to(kept.back());
  }
  for (const auto& recordings : kept) {
    RAVENCAL_RETURN_IF_ERROR(warn_of_implausible(pointers_to(recordings)));
  }
  a.options.why_not_measured = "no --plugin given";
  if (!a.plugin.empty()) {
    const record::Recording* first = data.sets.at("test").front();
    a.options.measure = [&a, first](const model::CalibrationModel& model) {
      return measure(a, *first, model);
    };
  }
  cli::catch_interrupts_of_work();
  cli::Progress progress("compare");
  a.options.look = [&](double done, std::string_view what) {
    progress.update(done, what);
    return !cli::interrupted();
  };
  RAVENCAL_ASSIGN_OR_RETURN(const study::CompareOutcome outcome, study::compare(data, a.options));
  RAVENCAL_RETURN_IF_ERROR(study::write_comparison(outcome.comparison, a.options.out));
  const auto tables = study::comparison_tables(outcome.comparison);
  if (!tables.empty()) core::say("{}\n", study::to_markdown(tables.front()));
  core::say("{}\n", study::verdict_text(outcome.comparison));
  if (outcome.interrupted)
    core::say(
        "interrupted: {} method(s) are done and kept; the same command continues with the others\n",
        outcome.comparison.methods.size());
  core::say("report: {}\n", (a.options.out / "compare.html").string());
  return {};
}

void add_data_options(CLI::App& command, CompareArguments& a) {
  command.add_option("--train", a.train, "Recordings to train on, sparse ones first (.db, .csv)")
      ->required();
  command
      .add_option("--test", a.sets["test"], "Recordings to test on; no setting is chosen on them")
      ->required();
  command.add_option("--test-load", a.sets["load"],
                     "Test recordings under a load that training never saw");
  command.add_option("--test-homing", a.sets["homing"], "Test recordings after another homing");
  command
      .add_option("--out", a.options.out, "Folder for compare.json, .html, .csv, .md, .tex, models")
      ->required();
  command.add_option("--test-profile", a.test_profile, "Profile of the test files, if another");
  add_same_seed_option(command, a.options.same_seed);
  (void)add_load_options(command, a.load);
  command.add_option("--title", a.options.title, "Title of the page");
  add_joints_option(command, a.options.joints);
  command.add_option("--features", a.options.features, "Inputs of all methods, as for train");
  command.add_option("--features-of", a.features_of,
                     "JOINT=FEATURES: inputs of one joint's own models; may be repeated");
  command
      .add_option("--play", a.options.play,
                  "Half-widths (SI units) of play operators, for our methods only")
      ->check(cli::positive())
      ->delimiter(',');
  command.add_flag("--poses", a.options.poses, "Rows are poses in no order of time");
  command.add_option("--physics", a.options.settings.physics,
                     "Folder that `ravencal diagnose --out` made from the training recordings");
}

void add_study_options(CLI::App& command, CompareArguments& a) {
  methods::Settings& s = a.options.settings;
  std::vector<std::string> ids;
  for (const auto& method : methods::all_methods()) ids.emplace_back(method->id());
  command
      .add_option("--methods", a.options.methods,
                  fmt::format("Only these of {}", fmt::join(ids, ", ")))
      ->delimiter(',');
  command.add_option("--shares", a.options.shares, "Parts of the training for the learning curve")
      ->check(CLI::Range(0.0, 1.0))
      ->delimiter(',')
      ->capture_default_str();
  command.add_flag_callback(
      "--no-curve", [&a] { a.options.shares.clear(); }, "Leave out the learning curve");
  command.add_option("--plugin", a.plugin, "libravencal_plugin.so: times models in the 1 kHz loop");
  command.add_option("--ticks", a.ticks, "Cycles of that loop")
      ->check(CLI::Range(std::int64_t{100}, std::int64_t{10'000'000}))
      ->capture_default_str();
  command
      .add_option("--step-budget-us", a.options.loop_budget_us, "Longest step that fits the loop")
      ->check(cli::positive())
      ->capture_default_str();
  add_hidden_option(command, s.hidden);
  add_activation_option(command, s.activation);
  add_epoch_options(command, s.epochs, s.batch);
  add_learning_rate_option(command, s.learning_rate);
  command
      .add_option(
          "--penalty-scale", s.penalty_scale,
          "Factor of the network's penalties; 0: blocked validation chooses it where rows are few")
      ->check(cli::not_negative());
  add_networks_option(command, s.networks);
  command.add_option("--gru-units", s.gru_units, "Units of the GRU (the authors': 300)")
      ->check(CLI::Range(1U, 4096U))
      ->capture_default_str();
  command
      .add_option("--gru-dense", s.gru_dense, "Units of the dense layer behind the GRU; 0: none")
      ->check(CLI::Range(0U, 4096U))
      ->capture_default_str();
  command.add_option("--gru-epochs", s.gru_epochs, "Epochs of the GRU")
      ->check(CLI::Range(1U, 1000000U))
      ->capture_default_str();
  command.add_option("--lstm-iterations", s.lstm_iterations, "Batches of 100 for the LSTM")
      ->check(CLI::Range(1U, 100000000U))
      ->capture_default_str();
  command.add_option("--inducing", s.inducing, "Points of the sparse Gaussian process")
      ->check(CLI::Range(2U, 4096U))
      ->capture_default_str();
  command.add_option("--trees", s.trees, "Trees of the random forest")
      ->check(CLI::Range(1U, 10000U))
      ->capture_default_str();
  command.add_option("--seed", s.seed, "Seed of every random draw")->capture_default_str();
  command.add_option("--threads", s.threads, "Threads of the network's training")
      ->check(CLI::Range(0U, 1024U))
      ->capture_default_str();
}

cli::Paths files_of_comparison(const CLI::App& command) {
  cli::Paths paths;
  for (const char* ending : {".json", ".html", ".csv", ".txt", ".md", ".tex"})
    paths.push_back(cli::path_of(command, "--out") / (std::string("compare") + ending));
  return paths;
}

/// --out, where a comparison has a result already.
cli::Paths folder_of_comparison(const CLI::App& command) {
  const std::filesystem::path folder = cli::path_of(command, "--out");
  return has_results(folder) ? cli::Paths{folder} : cli::Paths();
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command =
      app.add_subcommand("compare", "Compare calibration methods on one split, in one table");
  add_data_options(*command, *arguments);
  add_study_options(*command, *arguments);
  command->footer(
      "Example: ravencal diagnose run1.db run2.db --plant tools/plants/raven2.toml --out physics\n"
      "         ravencal compare --train run1.db run2.db --test run3.db --features light --play "
      "0.001,0.003 "
      "--physics physics --plugin libravencal_plugin.so --out comparison\n"
      "Finished methods are kept in OUT/jobs: after Ctrl-C the same command continues with the "
      "others.");
  on_call(*command, exit_code,
          {.read = {"--train", "--test", "--test-load", "--test-homing", "--profile",
                    "--test-profile", "--physics", "--plugin"},
           .folders = {"--out"},
           .also_written = files_of_comparison,
           .own = folder_of_comparison},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
