// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/study_run.hpp"
#include "core/temporary_folder.hpp"
#include "experiment/paper_recordings.hpp"
#include "physics/plant.hpp"

extern "C" {
// Names of the assembler (ravencal_embed_script). NOLINTNEXTLINE(readability-identifier-naming)
extern const char ravencal_raven2_plant[], ravencal_raven2_plant_end[];
}

namespace ravencal::commands {
namespace {

struct PaperArguments {
  StudyArguments study;
  std::string plant;
  experiment::PaperRecordingOptions recordings;
  bool quick = false;
  bool make = false;  ///< also for --plan
};

/// What --quick takes in place of the paper's settings, where no option says otherwise.
void shorten(const CLI::App& command, PaperArguments& arguments) {
  const auto is_open = [&](const char* option) { return command.count(option) == 0; };
  study::Settings& settings = arguments.study.settings;
  if (is_open("--hidden")) settings.hidden = {128, 64, 32};
  if (is_open("--epochs")) settings.epochs = 60;
  if (is_open("--seeds")) settings.seeds = 3;
  if (is_open("--test-s")) arguments.recordings.test_s = 1800.0;
}

core::Result<physics::Plant> plant_of(const PaperArguments& arguments) {
  if (!arguments.plant.empty()) return physics::load_plant(arguments.plant);
  return physics::parse_plant({ravencal_raven2_plant, ravencal_raven2_plant_end}, "raven2.toml");
}

void take(const experiment::PaperRecordings& made, StudyArguments& study) {
  study.train = made.train;
  study.test = made.test;
  study.train_loaded = made.train_loaded;
  study.test_loaded = made.test_loaded;
  study.train_rehomed = made.train_rehomed;
  study.test_homing = made.test_homing;
}

core::Status stand_in(const physics::Plant& plant, const experiment::PaperWork& work,
                      StudyArguments& study) {
  RAVENCAL_ASSIGN_OR_RETURN(core::TemporaryFolder folder, core::TemporaryFolder::create());
  RAVENCAL_ASSIGN_OR_RETURN(const experiment::PaperRecordings made,
                            experiment::make_stand_ins(plant, folder.path()));
  take(made, study);
  study.stand_ins = std::make_shared<StandIns>(StandIns{
      std::move(folder), experiment::kRowsOfZigzag,
      fmt::format(
          "{} recordings of the twin, {:.1f} h of motion, are to be made first, and no plan "
          "is written: the same command without --plan makes them and trains, with "
          "--make-recordings it makes them and writes the plan",
          work.recordings, work.motion_s / 3600.0)});
  return {};
}

core::Status make_recordings(const PaperArguments& arguments, StudyArguments& study) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, plant_of(arguments));
  const std::filesystem::path folder = std::filesystem::path(study.out) / "recordings";
  if (study.plan && !arguments.make) {
    RAVENCAL_ASSIGN_OR_RETURN(
        const experiment::PaperWork work,
        experiment::missing_paper_recordings(plant, arguments.recordings, folder));
    if (work.recordings > 0) return stand_in(plant, work, study);
  }
  cli::Progress progress("recordings");
  RAVENCAL_ASSIGN_OR_RETURN(
      const experiment::PaperRecordings made,
      experiment::make_paper_recordings(plant, arguments.recordings, folder, [&](double done) {
        progress.update(done);
        return !cli::interrupted();
      }));
  if (made.interrupted) {
    return core::Error{core::ErrorCode::kIo,
                       "interrupted: whole recordings are kept; the same command continues"};
  }
  take(made, study);
  return {};
}

void add_twin_options(CLI::App& command, PaperArguments& arguments) {
  command.add_option("--plant", arguments.plant,
                     "The robot (.toml) that the digital twin is of; default: RAVEN-II");
  command
      .add_option("--test-s", arguments.recordings.test_s,
                  "Test motion of each load, s; the paper's is six hours")
      ->check(CLI::Range(60.0, 86400.0))
      ->capture_default_str();
  command
      .add_option("--recording-seed", arguments.recordings.seed,
                  "Run and homing seeds of the recordings follow from it")
      ->capture_default_str();
  command.add_flag("--make-recordings", arguments.make,
                   "With --plan: make the twin's recordings and write plan.json, so that --job can "
                   "run; --plan alone lists the networks");
  command.add_flag(
      "--quick", arguments.quick,
      "Some ten minutes on two cores: --hidden 128,64,32 --epochs 60 --seeds 3 --test-s "
      "1800, where not given");
}

}  // namespace

void add_study(CLI::App& app, int& exit_code) {
  CLI::App* const study = app.add_subcommand("study", "Run a published study and print its tables");
  study->require_subcommand(1);
  auto arguments = std::make_shared<PaperArguments>();
  arguments->study.study = study::kPaperStudy;
  arguments->study.print_tables = true;
  CLI::App* const command = study->add_subcommand(
      "paper",
      "The ablation study of Peng, Lewis and Hannaford (arXiv 2302.04999), on the twin or "
      "on your recordings");
  command->add_option("--out", arguments->study.out, "Folder of recordings, plan, results, tables")
      ->required();
  add_twin_options(*command, *arguments);
  add_study_data_options(*command, arguments->study);
  add_study_network_options(*command, arguments->study);
  add_study_run_options(*command, arguments->study);
  command->footer(
      "Without recordings it makes the paper's on the digital twin: zig-zags of 3244 s in all at "
      "25 Hz, random\nmotion, both unloaded and with 500 g, and sets after 0 to 5 homings. The "
      "same "
      "command continues an interrupted\nstudy. On a cluster: --plan --make-recordings, then "
      "tools/calibration/slurm/study.sbatch, then --collect.\n"
      "Example: ravencal study paper --quick --out study");
  std::vector<std::string> read = kStudyInputs;
  read.emplace_back("--plant");
  on_call(
      *command, exit_code,
      {.read = read, .folders = {"--out"}, .also_written = files_of_study, .own = folder_of_study},
      [arguments, command, &exit_code] {
        PaperArguments own = *arguments;
        if (own.quick) shorten(*command, own);
        own.recordings.workers = own.study.pool.workers;
        own.study.make_recordings = [own](StudyArguments& given) {
          return make_recordings(own, given);
        };
        return run_study(own.study, exit_code);
      });
}

}  // namespace ravencal::commands
