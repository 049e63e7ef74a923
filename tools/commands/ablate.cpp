// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/study_run.hpp"

namespace ravencal::commands {

void add_ablate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<StudyArguments>();
  CLI::App* command =
      app.add_subcommand("ablate", "Find which features the calibration needs: the paper's study");
  command->add_option("study", arguments->study, "removal, inaccurate, torque, homing or all")
      ->required()
      ->check(CLI::IsMember({"removal", "inaccurate", "torque", "homing", "all"}));
  command->add_option("--out", arguments->out, "Folder of plan, results, tables and report")
      ->required();
  add_study_data_options(*command, *arguments);
  add_study_network_options(*command, *arguments);
  add_study_run_options(*command, *arguments);
  command->footer(
      "The same command continues an interrupted study. On a cluster: --plan, then\n"
      "tools/calibration/slurm/study.sbatch, then --collect.\n"
      "Example: ravencal ablate removal --train zigzag*.db --test random1.db --hidden 128,64,32 "
      "--epochs 60 --out study");
  on_call(*command, exit_code,
          {.read = kStudyInputs,
           .folders = {"--out"},
           .also_written = files_of_study,
           .own = folder_of_study},
          [arguments, &exit_code] { return run_study(*arguments, exit_code); });
}

}  // namespace ravencal::commands
