// SPDX-License-Identifier: Apache-2.0
#include "diagnose/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/robot_out.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "diagnose/findings/figures.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/findings/words.hpp"
#include "diagnose/given.hpp"
#include "diagnose/report/improved_robot.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose/track/input.hpp"
#include "exchange/load.hpp"

namespace ravencal::commands {
namespace {

struct DiagnoseArguments {
  DiagnoseArguments() { options.placebos = diagnose::kUsualPlacebos; }

  std::vector<std::string> recordings;
  std::vector<std::string> held_out;
  std::vector<std::string> simulated;
  std::string simulated_profile;
  std::string plant;
  std::string held_out_profile;
  std::string out;
  std::string json;
  bool check = false;
  record::LoadOptions load;
  diagnose::Options options;
};

core::Result<std::vector<record::Recording>> load_all(const std::vector<std::string>& paths,
                                                      record::LoadOptions load,
                                                      const std::string& other_profile) {
  if (!other_profile.empty()) load.profile = other_profile;
  load.keep = diagnose::looks_at;
  return exchange::load_recordings(paths, load);
}

void print_summary(const diagnose::Report& report, const std::string& out) {
  core::say("verdict: {}\n{}\n", diagnose::words_of(report.verdict.kind), report.verdict.text);
  if (!report.held_out.empty())
    core::say("Errors of the plant as it is and improved, {}:\n",
              diagnose::rows_words(diagnose::are_of_fitted_rows(report)));
  for (const diagnose::HeldOut& h : report.held_out) {
    const auto in_unit = [&h](double error) { return diagnose::quantity(error, h.unit); };
    core::say("  {:<12} {:<34} {} -> {}{}\n", h.joint, diagnose::metric_words(h.metric),
              in_unit(h.before), in_unit(h.after),
              h.floor ? fmt::format(" (floor {})", in_unit(*h.floor)) : "");
  }
  core::say("report: {}/report.html\n", out);
}

/// Blocks and folds follow the order of the recordings. The verdict must not, so they are sorted by
/// name. With --simulated the given order pairs the files and stays.
void put_in_order(DiagnoseArguments& arguments) {
  if (!arguments.simulated.empty()) return;
  std::sort(arguments.recordings.begin(), arguments.recordings.end());
  std::sort(arguments.held_out.begin(), arguments.held_out.end());
}

/// True if a profile is read for any of them: a .db says itself which column is what.
bool need_a_profile(const std::vector<std::string>& paths) {
  return std::any_of(paths.begin(), paths.end(), [](const std::string& path) {
    return std::filesystem::path(path).extension() != ".db";
  });
}

/// No profile is left unread in silence.
core::Status profiles_are_read(const DiagnoseArguments& a) {
  const auto refuse = [](std::string_view option, const std::string& path) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("{}: is not read, since {} needs no profile; leave it out", option, path)};
  };
  const bool first = need_a_profile(a.recordings) ||
                     (a.held_out_profile.empty() && need_a_profile(a.held_out)) ||
                     (a.simulated_profile.empty() && need_a_profile(a.simulated));
  if (!a.load.profile.empty() && !first) return refuse("--profile", a.recordings.front());
  if (!a.held_out_profile.empty() && !need_a_profile(a.held_out))
    return refuse("--held-out-profile", a.held_out.front());
  if (!a.simulated_profile.empty() && !need_a_profile(a.simulated))
    return refuse("--simulated-profile", a.simulated.front());
  return {};
}

diagnose::Given given_by(const DiagnoseArguments& a) {
  const auto list = [&](const std::vector<std::string>& paths, const std::string& other_profile) {
    std::vector<diagnose::GivenRecording> recordings;
    for (const std::string& path : paths) {
      recordings.push_back(
          {path, other_profile.empty() ? a.load.profile : other_profile, a.load.range});
    }
    return recordings;
  };
  return {list(a.recordings, {}), list(a.held_out, a.held_out_profile),
          list(a.simulated, a.simulated_profile)};
}

core::Result<bool> run(const DiagnoseArguments& arguments) {
  const diagnose::Given given = given_by(arguments);
  RAVENCAL_RETURN_IF_ERROR(diagnose::check_given(given));
  RAVENCAL_RETURN_IF_ERROR(profiles_are_read(arguments));
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.plant));
  RAVENCAL_ASSIGN_OR_RETURN(auto training, load_all(arguments.recordings, arguments.load, {}));
  RAVENCAL_ASSIGN_OR_RETURN(
      auto held_out, load_all(arguments.held_out, arguments.load, arguments.held_out_profile));
  diagnose::Options options = arguments.options;
  RAVENCAL_ASSIGN_OR_RETURN(options.simulated, load_all(arguments.simulated, arguments.load,
                                                        arguments.simulated_profile));
  cli::catch_interrupts_of_work();
  cli::Progress progress("diagnose");
  options.look = [&](double done, std::string_view what) {
    progress.update(done, what);
    return !cli::interrupted();
  };
  RAVENCAL_ASSIGN_OR_RETURN(diagnose::Report report,
                            diagnose::diagnose(training, held_out, plant, options));
  diagnose::add_provenance(given, plant, options, report);
  RAVENCAL_ASSIGN_OR_RETURN(const std::optional<diagnose::ImprovedRobot> robot,
                            diagnose::write_with_robot(report, arguments.plant, arguments.out));
  if (!arguments.json.empty()) {
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(arguments.json, diagnose::report_json(report)));
  }
  print_summary(report, arguments.out);
  if (robot) print_model(robot->written, robot->path);
  return report.verdict.kind != "nothing_left_out" && report.verdict.kind != "not_testable";
}

cli::Paths files_in_folder(const CLI::App& command) {
  return diagnose::files_of(cli::path_of(command, "--plant"), cli::path_of(command, "--out"));
}

cli::Paths own_files(const CLI::App& command) {
  return diagnose::own_files(cli::path_of(command, "--out"));
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DiagnoseArguments>();
  CLI::App* command = app.add_subcommand(
      "diagnose",
      "Find where simulation and recording differ, and which physics the simulation lacks");
  command
      ->add_option("recordings", arguments->recordings,
                   "Recordings (.db, or a .csv or another table with --profile)")
      ->required();
  command
      ->add_option("--plant", arguments->plant,
                   "The simulation (.toml, or a robot model: .xml, .urdf)")
      ->required();
  (void)add_load_options(*command, arguments->load);
  command
      ->add_option(
          "--out", arguments->out,
          "Folder for report.json, report.html, plant_improved.toml and, of a robot model, "
          "robot_improved.xml or .urdf")
      ->required();
  command->add_option("--json", arguments->json, "Also write report.json here");
  CLI::Option* held_out = command->add_option(
      "--held-out", arguments->held_out, "Recordings that no fit sees; the figures come from them");
  command
      ->add_option("--held-out-profile", arguments->held_out_profile,
                   "Profile of the held-out recordings, if another")
      ->needs(held_out);
  CLI::Option* simulated = command->add_option(
      "--simulated", arguments->simulated,
      "Another simulator's recordings, one per recording, held-out ones last: of the same motion "
      "with an effort of their own, or of the same command with a motion of their own. They "
      "replace the plant's own simulation; the plant then states what that simulator contains and "
      "the tolerance of its numbers");
  command
      ->add_option("--simulated-profile", arguments->simulated_profile,
                   "Profile of the simulations, if another")
      ->needs(simulated);
  command
      ->add_option("--held-out-from", arguments->options.held_out_from_s,
                   "Hold out each recording from this time on, s")
      ->check(cli::not_negative());
  command->add_flag("--all-rows", arguments->options.all_rows,
                    "Fit every row of long recordings, not only four minutes of three joints in "
                    "the stretches that move most");
  command->add_option("--alpha", arguments->options.alpha, "Chance of any false name in the report")
      ->check(CLI::Range(diagnose::kLeastAlpha, diagnose::kMostAlpha))
      ->capture_default_str();
  command
      ->add_option("--placebo", arguments->options.placebos,
                   "Placebo recordings, with nothing left out, that measure this recording's false "
                   "alarms; 0: none, in a third of the time")
      ->check(CLI::Range(0, diagnose::kMostPlacebos))
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Seed of every random draw")
      ->capture_default_str();
  command
      ->add_option("--threads", arguments->options.threads, "0: all cores; the result is the same")
      ->check(CLI::Range(0U, 1024U))
      ->capture_default_str();
  command->add_flag("--check", arguments->check, "Exit with 1 if a mismatch was found");
  command->footer(
      "Example: ravencal diagnose run1.db run2.db --plant tools/plants/raven2.toml --out "
      "diagnosis\n"
      "Figures are on --held-out recordings, else on rows from --held-out-from, else "
      "on those that were fitted.");
  const FileOptions files = {.read = {"recordings", "--plant", "--profile", "--held-out",
                                      "--held-out-profile", "--simulated", "--simulated-profile"},
                             .written = {"--json"},
                             .folders = {"--out"},
                             .also_written = files_in_folder,
                             .own = own_files,
                             .together = true};
  on_call(*command, exit_code, files, [arguments, &exit_code]() -> core::Status {
    put_in_order(*arguments);
    RAVENCAL_ASSIGN_OR_RETURN(const bool is_finding, run(*arguments));
    if (arguments->check && is_finding) exit_code = cli::kFinding;
    return {};
  });
}

}  // namespace ravencal::commands
