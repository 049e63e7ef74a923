// SPDX-License-Identifier: Apache-2.0
#include "commands/study_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/network_options.hpp"
#include "commands/same_seed_option.hpp"
#include "core/terminal.hpp"
#include "learn/shared_seeds.hpp"
#include "study/ablation_report.hpp"
#include "study/ablation_tables.hpp"
#include "study/paper_figures.hpp"

namespace ravencal::commands {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> absolute(const std::vector<std::string>& paths) {
  std::vector<std::string> result;
  for (const std::string& path : paths) result.push_back(fs::absolute(path).string());
  return result;
}

/// Which recordings answer which question. Homing tests are after 0, 1, 2, ... homings.
std::vector<study::Condition> conditions_of(const StudyArguments& a) {
  std::vector<study::Condition> conditions;
  const auto add = [&](std::string_view title, const auto& train, const auto& test, bool homing,
                       bool rehomed) {
    conditions.push_back({std::string(title), absolute(train), absolute(test), homing, rehomed});
  };
  const bool only_homing = a.study == "homing";
  if (!only_homing) add(study::kUnloaded, a.train, a.test, false, false);
  if (!only_homing && (!a.train_loaded.empty() || !a.test_loaded.empty())) {
    add(study::kLoaded, a.train_loaded, a.test_loaded, false, false);
  }
  const auto& runs = only_homing && a.test_homing.empty() ? a.test : a.test_homing;
  const bool with_homing = only_homing || a.study == "all" || a.study == study::kPaperStudy;
  if (with_homing && !runs.empty()) {
    add(study::kHomedOnce, a.train, runs, true, false);
    if (!a.train_rehomed.empty()) add(study::kRehomed, a.train_rehomed, runs, true, true);
  }
  return conditions;
}

std::string minutes(double seconds) {
  return seconds < 120.0 ? fmt::format("{:.0f} s", seconds)
                         : fmt::format("{:.0f} min", seconds / 60.0);
}

/// Says which inputs are no longer those of the plan that lies in the folder.
void tell_changes(const study::Plan& plan, const fs::path& folder) {
  if (!fs::exists(study::plan_path(folder))) return;
  const auto before = study::read_plan(folder);
  if (!before.ok()) return;
  for (const study::Input& input : plan.inputs) {
    for (const study::Input& old : before->inputs) {
      if (old.path == input.path && old.sha256 != input.sha256) {
        core::remark(
            "ravencal: warning: {} changed since the last plan: its networks are "
            "trained anew\n",
            input.path);
      }
    }
  }
}

/// Says what of the plan in the folder is not what the options ask for now: "--epochs 60, not 600".
std::vector<std::string> differences(const study::Plan& before, const StudyArguments& now) {
  std::vector<std::string> list;
  const auto compare = [&list](const char* what, const auto& then, const auto& asked) {
    if (then != asked) list.push_back(fmt::format("{} {}, not {}", what, then, asked));
  };
  const study::Settings& a = before.settings;
  const study::Settings& b = now.settings;
  compare("study", before.study, now.study);
  compare("--hidden", fmt::format("{}", fmt::join(a.hidden, ",")),
          fmt::format("{}", fmt::join(b.hidden, ",")));
  compare("--epochs", a.epochs, b.epochs);
  compare("--batch", a.batch, b.batch);
  compare("--seeds", a.seeds, b.seeds);
  compare("--seed", a.first_seed, b.first_seed);
  compare("--noise-from", study::name_of(a.noise_from), study::name_of(b.noise_from));
  const auto compare_features = [&](const char* option, const std::string& then,
                                    const std::string& asked, std::string_view preferred) {
    if (!asked.empty() || (!then.empty() && then != preferred)) {
      compare(option, then, asked.empty() ? std::string(preferred) : asked);
    }
  };
  compare_features("--features", a.features, b.features, study::kBaseFeatures);
  compare_features("--homing-features", a.homing_features, b.homing_features,
                   study::kHomingFeatures);
  compare("--profile", before.load.profile, now.load.profile);
  compare("--arm", before.load.profile_options.arm, now.load.profile_options.arm);
  compare("--skip-bad", before.load.skip_bad, now.load.skip_bad);
  const auto seconds = [](const std::optional<double>& time_s) {
    return time_s ? fmt::format("{}", *time_s) : "none";
  };
  compare("--from-s", seconds(before.load.range.from_s), seconds(now.load.range.from_s));
  compare("--to-s", seconds(before.load.range.to_s), seconds(now.load.range.to_s));
  if (now.train.empty()) return list;  // they are still to be made
  const auto paths = [](const std::vector<study::Condition>& conditions) {
    std::vector<std::vector<std::string>> all;
    for (const study::Condition& c : conditions)
      all.insert(all.end(), {{c.title}, c.train, c.test});
    return all;
  };
  if (paths(before.conditions) != paths(conditions_of(now))) list.emplace_back("other recordings");
  return list;
}

/// Another plan in place of one that has results would leave tables that no plan explains.
core::Status keep_plan(const StudyArguments& arguments) {
  const fs::path path = study::plan_path(arguments.out);
  if (!fs::exists(path)) return {};
  const auto before = study::read_plan(arguments.out);
  if (!before.ok()) return {};  // to write it again is the way out of a damaged one
  const std::vector<std::string> differ = differences(*before, arguments);
  if (differ.empty()) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const auto missing, study::missing_jobs(*before, arguments.out));
  if (missing.size() == before->jobs.size()) return {};
  return core::usage_error(fmt::format(
      "--out {}: holds the results of another plan: {}. Give another --out, or the options of that "
      "plan; to replace it, remove {} (networks that fit the new plan are kept)",
      arguments.out, fmt::join(differ, "; "), path.string()));
}

core::Result<study::Plan> planned(StudyArguments& arguments, study::RecordingStore& recordings) {
  if (arguments.train.empty() || (arguments.test.empty() && arguments.test_homing.empty())) {
    return core::usage_error(fmt::format(
        "--train and --test: name the recordings{} (only --job and --collect go by the plan)",
        arguments.make_recordings ? " beside the others that you name, or none for the twin's"
                                  : ""));
  }
  if (!arguments.train_rehomed.empty() && arguments.test_homing.empty() &&
      arguments.study != "homing") {
    return core::usage_error("--train-rehomed: name its tests as well, --test-homing");
  }
  RAVENCAL_RETURN_IF_ERROR(keep_plan(arguments));
  RAVENCAL_ASSIGN_OR_RETURN(study::Plan plan,
                            study::make_plan(arguments.study, arguments.settings, arguments.load,
                                             conditions_of(arguments), recordings));
  for (const study::Condition& condition : plan.conditions) {
    if (!arguments.same_seed) RAVENCAL_RETURN_IF_ERROR(learn::check_run_seeds(condition.shared));
    print_warnings(learn::sentences_of(condition.shared));
  }
  std::error_code error;
  fs::create_directories(fs::path(arguments.out) / "jobs", error);
  if (error) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("--out {}: {}", arguments.out, error.message())};
  }
  tell_changes(plan, arguments.out);
  RAVENCAL_RETURN_IF_ERROR(study::write_plan(plan, arguments.out));
  return plan;
}

/// Job numbers as Slurm's --array takes them: 0-5,7.
std::string ranges_of(const std::vector<std::size_t>& jobs) {
  std::string text;
  for (std::size_t i = 0; i < jobs.size();) {
    std::size_t end = i;
    while (end + 1 < jobs.size() && jobs[end + 1] == jobs[end] + 1) ++end;
    text += fmt::format("{}{}", text.empty() ? "" : ",", jobs[i]);
    if (end > i) text += fmt::format("-{}", jobs[end]);
    i = end + 1;
  }
  return text;
}

unsigned workers_of(const StudyArguments& arguments) {
  return arguments.pool.workers > 0 ? arguments.pool.workers
                                    : std::max(1U, std::thread::hardware_concurrency());
}

core::Status show_plan(const study::Plan& plan, const StudyArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto missing, study::missing_jobs(plan, arguments.out));
  const double seconds = study::estimated_seconds(plan, missing);
  if (arguments.json) {
    using Json = nlohmann::ordered_json;
    const Json path = arguments.stand_ins ? Json() : Json(study::plan_path(arguments.out).string());
    const Json json = {{"plan", path},
                       {"jobs", plan.jobs.size()},
                       {"missing", missing.size()},
                       {"array", ranges_of(missing)},
                       {"core_seconds", seconds}};
    core::say("{}\n", json.dump());
    return {};
  }
  for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
    const study::Job& job = plan.jobs[i];
    const bool done = !std::binary_search(missing.begin(), missing.end(), i);
    core::say("{:>4}  {:<26} {:<22} seed {:<3} {:>3} features{}\n", i,
              plan.conditions[job.condition].title, job.row, job.seed, job.width,
              done ? "  done" : "");
  }
  for (const std::string& sentence : plan.left_out) core::say("left out: {}\n", sentence);
  core::say("{} networks, {} to train: about {} of one core, {} with {} at a time\n",
            plan.jobs.size(), missing.size(), minutes(seconds),
            minutes(seconds / workers_of(arguments)), workers_of(arguments));
  return {};
}

/// The jobs of a study whose recordings are not made yet; writes nothing.
core::Status list_unmade(const StudyArguments& arguments, study::RecordingStore& recordings) {
  RAVENCAL_ASSIGN_OR_RETURN(study::Plan plan,
                            study::make_plan(arguments.study, arguments.settings, arguments.load,
                                             conditions_of(arguments), recordings));
  for (study::Input& input : plan.inputs) input.rows = arguments.stand_ins->rows;
  RAVENCAL_RETURN_IF_ERROR(show_plan(plan, arguments));
  core::remark("{}\n", arguments.stand_ins->sentence);
  return {};
}

core::Status collect(const study::Plan& plan, const StudyArguments& arguments, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const study::Results results, study::read_results(plan, arguments.out));
  if (!results.missing.empty() && !arguments.partial) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{} of {} jobs have no result: {}; run them, or add --partial for tables with "
                    "gaps",
                    results.missing.size(), plan.jobs.size(), ranges_of(results.missing))};
  }
  const std::vector<study::Finding> findings = study::findings_of(results);
  const std::vector<study::Table> tables = study::ablation_tables(plan, results);
  RAVENCAL_RETURN_IF_ERROR(
      study::write_ablation_report(plan, results, tables, findings, arguments.out));
  if (arguments.json) {
    core::say("{}", study::findings_json(findings));
  } else {
    if (arguments.print_tables) {
      for (const study::Table& table : tables) {
        core::say("{}\n", study::to_text(table));
      }
    }
    core::say("{}report: {}\n", study::findings_text(findings),
              (fs::path(arguments.out) / "report.html").string());
  }
  if (arguments.check && !study::all_hold(findings)) exit_code = cli::kFinding;
  return {};
}

core::Status run_jobs(const study::Plan& plan, const StudyArguments& arguments,
                      study::RecordingStore& recordings) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto missing, study::missing_jobs(plan, arguments.out));
  if (missing.empty()) return {};
  const double seconds = study::estimated_seconds(plan, missing) / workers_of(arguments);
  core::remark("{} of {} networks to train, {} at a time: about {}\n", missing.size(),
               plan.jobs.size(), workers_of(arguments), minutes(seconds));
  cli::Progress progress("networks");
  RAVENCAL_ASSIGN_OR_RETURN(const study::PoolSummary summary,
                            study::run_all(plan, arguments.out, recordings, arguments.pool,
                                           [&](double done, const std::string& detail) {
                                             progress.update(done, detail);
                                             return !cli::interrupted();
                                           }));
  if (!summary.interrupted) {
    core::remark("{} networks trained and tested in {:.1f} s, {} were there\n", summary.ran,
                 summary.wall_s, summary.there_already);
    return {};
  }
  return core::Error{
      core::ErrorCode::kIo,
      fmt::format("interrupted: {} of {} networks are done; the same command continues",
                  summary.there_already + summary.ran, plan.jobs.size())};
}

}  // namespace

bool has_results(const fs::path& folder) {
  std::error_code absent;
  const fs::directory_iterator jobs(folder / "jobs", absent);
  return std::any_of(begin(jobs), end(jobs), [](const fs::directory_entry& job) {
    return cli::is_record_of_run(job.path(), {"schema", "job"});
  });
}

cli::Paths folder_of_study(const CLI::App& command) {
  const fs::path folder = cli::path_of(command, "--out");
  const bool is_planned = cli::is_record_of_run(study::plan_path(folder), {"schema", "jobs"});
  if (is_planned || has_results(folder)) return {folder};
  return {};
}

cli::Paths files_of_study(const CLI::App& command) {
  const fs::path folder = cli::path_of(command, "--out");
  cli::Paths paths;
  for (const char* name : {"plan.json", "findings.json", "report.html", "tables.csv", "tables.txt",
                           "tables.md", "tables.tex"})
    paths.push_back(folder / name);
  return paths;
}

core::Status run_study(StudyArguments arguments, int& exit_code) {
  if (static_cast<int>(arguments.plan) + static_cast<int>(arguments.job.has_value()) +
          static_cast<int>(arguments.collect) >
      1) {
    return core::usage_error("--plan, --job and --collect: one at a time");
  }
  cli::catch_interrupts_of_work();
  if (arguments.job || arguments.collect) {
    RAVENCAL_ASSIGN_OR_RETURN(const study::Plan plan, study::read_plan(arguments.out));
    if (arguments.collect) return collect(plan, arguments, exit_code);
    study::RecordingStore recordings(plan.load);
    return study::run_one(plan, *arguments.job, arguments.out, recordings, arguments.pool.threads,
                          [](double) { return !cli::interrupted(); });
  }
  const bool none_named = arguments.train.empty() && arguments.test.empty() &&
                          arguments.train_loaded.empty() && arguments.test_loaded.empty() &&
                          arguments.train_rehomed.empty() && arguments.test_homing.empty();
  if (none_named && arguments.plan) {
    const auto plan = study::read_plan(arguments.out);
    if (plan.ok()) return show_plan(*plan, arguments);
    if (!arguments.make_recordings) return plan.error();
  }
  if (none_named && arguments.make_recordings) {
    RAVENCAL_RETURN_IF_ERROR(keep_plan(arguments));
    RAVENCAL_RETURN_IF_ERROR(arguments.make_recordings(arguments));
  }
  study::RecordingStore recordings(arguments.load);
  if (arguments.stand_ins) return list_unmade(arguments, recordings);
  RAVENCAL_ASSIGN_OR_RETURN(const study::Plan plan, planned(arguments, recordings));
  if (arguments.plan) return show_plan(plan, arguments);
  RAVENCAL_RETURN_IF_ERROR(run_jobs(plan, arguments, recordings));
  return collect(plan, arguments, exit_code);
}

void add_study_data_options(CLI::App& command, StudyArguments& arguments) {
  command.add_option("--train", arguments.train, "Recordings to train on, no load");
  command.add_option("--test", arguments.test,
                     "Recordings to test on; for homing: after 0, 1, 2, ... homings");
  command.add_option("--train-loaded", arguments.train_loaded, "The same with 500 g");
  command.add_option("--test-loaded", arguments.test_loaded, "The same with 500 g");
  command.add_option("--test-homing", arguments.test_homing,
                     "Recordings after 0, 1, 2, ... homings since those of --train");
  command.add_option("--train-rehomed", arguments.train_rehomed,
                     "Recordings to train on, of several homings");
  add_same_seed_option(command, arguments.same_seed);
  (void)add_load_options(command, arguments.load);
}

void add_study_network_options(CLI::App& command, StudyArguments& arguments) {
  study::Settings& settings = arguments.settings;
  command.add_option("--features", settings.features,
                     fmt::format("Features that are ablated; default: {}", study::kBaseFeatures));
  command.add_option(
      "--homing-features", settings.homing_features,
      fmt::format("All features of the homing study; default: {}", study::kHomingFeatures));
  add_hidden_option(command, settings.hidden);
  add_epoch_options(command, settings.epochs, settings.batch);
  command
      .add_option_function<std::string>(
          "--noise-from",
          [&settings](const std::string& rows) {
            settings.noise_from = study::noise_from_name(rows).value();
          },
          "Rows whose deviation is the inaccurate features' noise: test (the authors') or training")
      ->check(CLI::IsMember({"test", "training"}))
      ->default_str("test");
  command.add_option("--seeds", settings.seeds, "Networks per row")
      ->check(CLI::Range(1U, study::kMostSeeds))
      ->capture_default_str();
  command
      .add_option("--seed", settings.first_seed,
                  "Seed of the first network; each further one adds 10")
      ->capture_default_str();
}

void add_study_run_options(CLI::App& command, StudyArguments& arguments) {
  command.add_flag(
      "--plan", arguments.plan,
      "List the jobs and the time they take; train nothing. Without recordings: those of the plan "
      "in --out");
  command.add_option("--job", arguments.job, "Run this job of the plan in --out, and no other");
  command.add_flag("--collect", arguments.collect, "Make tables and report of the plan's results");
  command.add_flag("--partial", arguments.partial,
                   "With --collect: leave gaps where jobs have no result");
  command
      .add_option("--workers", arguments.pool.workers,
                  "Networks at the same time; 0: one per core. Changes no result")
      ->check(CLI::Range(0U, 1024U));
  command.add_option("--threads", arguments.pool.threads, "Threads per network; changes no result")
      ->check(CLI::Range(1U, 1024U))
      ->capture_default_str();
  command.add_flag("--check", arguments.check, "Exit with 1 unless every tested finding holds");
  command.add_flag("--json", arguments.json, "Print the plan's size or the findings as JSON");
}

}  // namespace ravencal::commands
