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
#include "commands/experiment.hpp"
#include "commands/simulated_motion.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose/track/input.hpp"
#include "record/load.hpp"

namespace ravencal::commands {
namespace {

namespace fs = std::filesystem;

struct SuggestArguments {
  std::string source;
  std::string plant;
  std::string profile;
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
  record::LoadOptions load;
  load.profile = arguments.profile;
  load.keep = [&out](const record::Channel& c) { return diagnose::looks_at(c, *out.nominal); };
  std::vector<record::Recording> recordings(1);
  RAVENCAL_ASSIGN_OR_RETURN(recordings.front(), record::load_recording(arguments.source, load));
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
  std::optional<PredictedPower> power;
};

core::Result<std::vector<Entry>> entries_of(const SuggestArguments& arguments,
                                            const Diagnosis& diagnosis) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto suggestions,
                            diagnose::suggest(diagnosis.report, arguments.source));
  std::vector<Entry> entries;
  int tried = 0;
  cli::Progress progress("predict");
  for (const diagnose::Suggestion& s : suggestions) {
    Entry entry{s, std::nullopt};
    if (diagnosis.improved && tried < arguments.tried && can_try(s, *diagnosis.nominal)) {
      progress.update(static_cast<double>(tried) / arguments.tried, s.experiment);
      RAVENCAL_ASSIGN_OR_RETURN(
          entry.power,
          predict_power(s, *diagnosis.nominal, *diagnosis.improved, arguments.repetitions,
                        arguments.seed, [] { return !cli::interrupted(); }));
      ++tried;
    }
    entries.push_back(std::move(entry));
  }
  return entries;
}

void print_power(const PredictedPower& p) {
  if (p.with_effect) {
    fmt::print(
        "   on the twin: told apart in {} of {} such recordings; named although absent in {} of "
        "{}\n",
        p.parted, p.repetitions, p.named_anyway, p.repetitions);
  } else {
    fmt::print("   on the twin: testable in {} of {} such recordings\n", p.testable, p.repetitions);
  }
}

void print_json(const std::vector<Entry>& entries) {
  std::vector<diagnose::Suggestion> suggestions;
  for (const Entry& e : entries) suggestions.push_back(e.suggestion);
  nlohmann::json json = nlohmann::json::parse(diagnose::suggestions_json(suggestions));
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto& power = entries[i].power;
    if (!power) continue;
    const double n = std::max(1, power->repetitions);
    nlohmann::json predicted = {{"repetitions", power->repetitions},
                                {"testable", power->testable / n}};
    if (power->with_effect) {
      predicted["power"] = power->parted / n;
      predicted["named_although_absent"] = power->named_anyway / n;
    }
    json["suggestions"][i]["predicted"] = std::move(predicted);
  }
  fmt::print("{}\n", json.dump(2));
}

core::Status run(const SuggestArguments& arguments) {
  cli::catch_interrupts_of_work();
  const bool is_report = fs::path(arguments.source).extension() == ".json";
  RAVENCAL_ASSIGN_OR_RETURN(const Diagnosis diagnosis,
                            is_report ? read_report(arguments) : diagnosed(arguments));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<Entry> entries, entries_of(arguments, diagnosis));
  if (arguments.json) {
    print_json(entries);
    return {};
  }
  if (entries.empty()) {
    fmt::print("Nothing is left to tell apart or to test: no further recording would help.\n");
    return {};
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const diagnose::Suggestion& s = entries[i].suggestion;
    fmt::print("{}. {} ({:.0f} min)\n   {}\n", i + 1, s.experiment, s.minutes, s.why);
    if (entries[i].power) print_power(*entries[i].power);
  }
  if (diagnosis.nominal && arguments.tried > 0 && !simulation_runs(*diagnosis.nominal)) {
    fmt::print(
        "How likely these answer was not predicted: the twin runs arms of three joints with "
        "[joint.controller] and [joint.homing], which this plant lacks.\n");
  } else if (diagnosis.nominal && arguments.tried > 0 && !diagnosis.improved) {
    fmt::print(
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
  command->add_option("--profile", arguments->profile, "Profile of a recording that is no .db");
  command->add_option("--try", arguments->tried, "Suggestions to try on the twin")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->add_option("--repetitions", arguments->repetitions, "Simulated recordings of each")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--seed", arguments->seed, "Seed of the simulations")->capture_default_str();
  command->add_flag("--json", arguments->json, "Print the suggestions as JSON");
  command->footer("Example: ravencal suggest diagnosis --plant tools/plants/raven2.toml");
  on_call(*command, exit_code, {}, [arguments] {
    if (fs::is_directory(arguments->source)) arguments->source += "/report.json";
    return run(*arguments);
  });
}

}  // namespace ravencal::commands
