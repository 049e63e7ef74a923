// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/suggest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/constants.hpp"
#include "core/terminal.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose/track/input.hpp"
#include "exchange/load.hpp"
#include "experiment/motion.hpp"
#include "experiment/power.hpp"

namespace ravencal::commands {
namespace {

namespace fs = std::filesystem;

struct SuggestArguments {
  std::string source;
  std::string plant;
  record::LoadOptions load;
  std::string out;
  int repetitions = 3;
  int tried = 2;
  std::uint64_t seed = 1;
  bool json = false;
};

/// The report's text and the plant that it improved, as far as they are known.
struct Diagnosis {
  std::string report;
  std::optional<physics::Plant> nominal, improved;
};

core::Error no_plant(const std::string& source) {
  return {core::ErrorCode::kUsage,
          fmt::format("{}: a recording needs --plant, to be diagnosed first", source)};
}

core::Result<Diagnosis> diagnosed(const SuggestArguments& arguments) {
  if (arguments.plant.empty()) return no_plant(arguments.source);
  Diagnosis out;
  RAVENCAL_ASSIGN_OR_RETURN(out.nominal, physics::load_plant(arguments.plant));
  record::LoadOptions load = arguments.load;
  load.keep = diagnose::looks_at;
  std::vector<record::Recording> recordings(1);
  RAVENCAL_ASSIGN_OR_RETURN(recordings.front(), exchange::load_recording(arguments.source, load));
  diagnose::Options options;
  options.seed = arguments.seed;
  cli::Progress progress("diagnose");
  options.look = [&](double done, std::string_view what) {
    progress.update(done, what);
    return !cli::interrupted();
  };
  RAVENCAL_ASSIGN_OR_RETURN(diagnose::Report report,
                            diagnose::diagnose(recordings, {}, *out.nominal, options));
  out.report = diagnose::report_json(report);
  out.improved = std::move(report.improved);
  return out;
}

core::Result<Diagnosis> read_report(const SuggestArguments& arguments) {
  std::ifstream file(arguments.source, std::ios::binary);
  if (!file) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be opened; give the report.json that `ravencal "
                                   "diagnose --out` wrote, or a recording with --plant",
                                   arguments.source)};
  }
  Diagnosis out;
  out.report.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  if (arguments.plant.empty()) return out;
  RAVENCAL_ASSIGN_OR_RETURN(out.nominal, physics::load_plant(arguments.plant));
  const fs::path beside = fs::path(arguments.source).parent_path() / "plant_improved.toml";
  if (fs::exists(beside)) {
    RAVENCAL_ASSIGN_OR_RETURN(out.improved, physics::load_plant(beside));
  }
  return out;
}

struct Entry {
  diagnose::Suggestion suggestion;
  std::optional<experiment::PredictedPower> power{};
  double bits = 0.0;                ///< expected of `power`; 0 without
  trajectory::Trajectory motion{};  ///< empty where it has none of its own
  fs::path file{};                  ///< of the motion, where one was asked for
};

/// Everything that is printed.
struct Advice {
  std::vector<Entry> entries;
  std::vector<diagnose::Explored> explored;
  std::string without_trajectories;  ///< why there are none; empty where there are
};

/// Named by the place in the list and the effect that it asks for.
core::Status write_motions(const SuggestArguments& arguments, std::vector<Entry>& entries) {
  std::error_code error;
  fs::create_directories(arguments.out, error);
  if (error)
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: {}", arguments.out, error.message())};
  for (std::size_t i = 0; i < entries.size(); ++i) {
    Entry& e = entries[i];
    if (e.motion.t_s.empty()) continue;
    e.file = fs::path(arguments.out) / fmt::format("{:02}_{}.csv", i + 1, e.suggestion.ids.front());
    RAVENCAL_RETURN_IF_ERROR(trajectory::write_csv(e.motion, e.file));
  }
  return {};
}

/// Of the effect that the suggestion asks for, before the recording.
double prior_of(const std::vector<experiment::ReportedEffect>& reported,
                const diagnose::Suggestion& s) {
  const auto same =
      std::find_if(reported.begin(), reported.end(), [&](const experiment::ReportedEffect& b) {
        return b.id == s.ids.front() && b.joint == s.joint;
      });
  return same == reported.end() ? 0.5 : same->probability;
}

core::Status try_some(const SuggestArguments& arguments, const Diagnosis& diagnosis,
                      std::vector<Entry>& entries) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<experiment::ReportedEffect> reported,
                            experiment::reported_effects(diagnosis.report, arguments.source));
  const experiment::Trial trial{*diagnosis.nominal, *diagnosis.improved,
                                reported,           arguments.repetitions,
                                arguments.seed,     [] { return !cli::interrupted(); }};
  cli::Progress progress("predict");
  int tried = 0;
  for (Entry& entry : entries) {
    const diagnose::Suggestion& s = entry.suggestion;
    if (tried == arguments.tried) break;
    if (entry.motion.t_s.empty()) continue;
    progress.update(static_cast<double>(tried) / arguments.tried, s.experiment);
    RAVENCAL_ASSIGN_OR_RETURN(entry.power, experiment::predict_power(s, entry.motion, trial));
    if (entry.power->with_effect) entry.bits = entry.power->information_bits(prior_of(reported, s));
    ++tried;
  }
  return {};
}

core::Result<Advice> advice_of(const SuggestArguments& arguments, const Diagnosis& diagnosis) {
  RAVENCAL_ASSIGN_OR_RETURN(diagnose::Next next,
                            diagnose::suggest(diagnosis.report, arguments.source));
  Advice advice{{}, std::move(next.explored), {}};
  for (diagnose::Suggestion& s : next.suggestions) advice.entries.push_back({std::move(s)});
  if (!diagnosis.nominal) {
    advice.without_trajectories = "the plant is not known; give it by --plant";
    return advice;
  }
  const auto bounds = experiment::bounds_of(advice.explored, *diagnosis.nominal);
  if (!bounds.ok()) {
    advice.without_trajectories = bounds.error().message;
    return advice;
  }
  for (Entry& e : advice.entries) {
    if (e.suggestion.motion == diagnose::Exercise::kNone) continue;
    RAVENCAL_ASSIGN_OR_RETURN(e.motion, experiment::motion_of(e.suggestion.motion, *bounds));
    e.suggestion.minutes = e.motion.duration_s() / 60.0;
  }
  if (diagnosis.improved) RAVENCAL_RETURN_IF_ERROR(try_some(arguments, diagnosis, advice.entries));
  if (!arguments.out.empty()) RAVENCAL_RETURN_IF_ERROR(write_motions(arguments, advice.entries));
  return advice;
}

void print_power(const Entry& entry) {
  const experiment::PredictedPower& p = *entry.power;
  if (p.with_effect) {
    core::say(
        "   on the twin: told apart in {} of {} such recordings; named although absent in {} of "
        "{}; expected information {:.2f} bits\n",
        p.parted, p.repetitions, p.named_anyway, p.repetitions, entry.bits);
  } else {
    core::say("   on the twin: testable in {} of {} such recordings\n", p.testable, p.repetitions);
  }
}

/// In degrees and millimetres, as operators read them.
std::string reach_of(const diagnose::Explored& e) {
  const bool turns = e.position_unit == "rad";
  const double factor = turns ? 1.0 / core::kRadPerDeg : 1e3;
  const char* unit = turns ? "deg" : "mm";
  std::string text =
      fmt::format("{} {:.1f} to {:.1f} {} at up to {:.3g} {}/s", e.joint, factor * e.position.first,
                  factor * e.position.second, unit, factor * e.fastest, unit);
  if (e.load)
    text += fmt::format(" and {:.3g} to {:.3g} {}", e.load->first, e.load->second, e.effort_unit);
  return text;
}

void print_json(const Advice& advice) {
  nlohmann::ordered_json json = {{"suggestions", nlohmann::ordered_json::array()},
                                 {"explored", advice.explored}};
  for (const Entry& e : advice.entries) {
    nlohmann::ordered_json one = e.suggestion;
    if (e.power) {
      const double n = std::max(1, e.power->repetitions);
      one["predicted"] = {{"repetitions", e.power->repetitions},
                          {"testable", e.power->testable / n}};
      if (e.power->with_effect) {
        one["predicted"]["power"] = e.power->parted / n;
        one["predicted"]["named_although_absent"] = e.power->named_anyway / n;
        one["predicted"]["information_bits"] = e.bits;
      }
    }
    if (!e.file.empty()) one["trajectory"] = e.file.string();
    json["suggestions"].push_back(std::move(one));
  }
  core::say("{}\n", json.dump(2));
}

void print(const Advice& advice) {
  for (std::size_t i = 0; i < advice.entries.size(); ++i) {
    const Entry& e = advice.entries[i];
    core::say("{}. {} ({:.0f} min)\n   {}\n", i + 1, e.suggestion.experiment, e.suggestion.minutes,
              e.suggestion.why);
    if (e.power) print_power(e);
    if (!e.file.empty())
      core::say("   {}: for `ravencal simulate` and, of a RAVEN arm, `ravencal run`\n",
                e.file.string());
  }
  if (advice.explored.empty()) return;
  core::say("The diagnosed recordings reached, and the trajectories stay within:\n");
  for (const diagnose::Explored& e : advice.explored) core::say("   {}\n", reach_of(e));
}

core::Status run(const SuggestArguments& arguments) {
  cli::catch_interrupts_of_work();
  const bool is_report = fs::path(arguments.source).extension() == ".json";
  RAVENCAL_ASSIGN_OR_RETURN(const Diagnosis diagnosis,
                            is_report ? read_report(arguments) : diagnosed(arguments));
  RAVENCAL_ASSIGN_OR_RETURN(const Advice advice, advice_of(arguments, diagnosis));
  if (!arguments.out.empty() && !advice.without_trajectories.empty())
    return core::data_error(
        fmt::format("--out: no trajectory can be made: {}", advice.without_trajectories));
  if (arguments.json) {
    print_json(advice);
    return {};
  }
  if (advice.entries.empty()) {
    core::say("Nothing is left to tell apart or to test: no further recording would help.\n");
    return {};
  }
  print(advice);
  if (diagnosis.nominal && arguments.tried > 0 && !diagnosis.improved) {
    core::say(
        "How likely these answer was not predicted: there is no plant_improved.toml beside {}.\n",
        arguments.source);
  }
  return {};
}

}  // namespace

void add_suggest(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SuggestArguments>();
  CLI::App* command = app.add_subcommand("suggest", "Suggest the next recording from a diagnosis");
  command
      ->add_option("source", arguments->source,
                   "Folder or report.json of `ravencal diagnose`, or a recording to diagnose first")
      ->required();
  command->add_option("--plant", arguments->plant,
                      "The plant that was diagnosed. With it and plant_improved.toml beside the "
                      "report, the twin simulates how likely the first suggestions give an answer");
  (void)add_load_options(*command, arguments->load);
  command->add_option("--try", arguments->tried, "Suggestions to try on the twin")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->add_option("--repetitions", arguments->repetitions, "Simulated recordings of each")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--seed", arguments->seed, "Seed of the simulations")->capture_default_str();
  command->add_option("--out", arguments->out,
                      "Folder for the suggested motions as trajectories of all joints, within the "
                      "positions and speeds of the diagnosed recordings and [joint.limits]; needs "
                      "--plant");
  command->add_flag("--json", arguments->json, "Print the suggestions as JSON");
  command->footer(
      "Example: ravencal suggest diagnosis --plant tools/plants/raven2.toml --out next");
  const FileOptions files = {
      .read = {"source", "--plant", "--profile"}, .folders = {"--out"}, .together = true};
  on_call(*command, exit_code, files, [arguments] {
    if (fs::is_directory(arguments->source)) arguments->source += "/report.json";
    return run(*arguments);
  });
}

}  // namespace ravencal::commands
