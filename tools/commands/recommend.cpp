// SPDX-License-Identifier: Apache-2.0
#include "study/recommend.hpp"

#include <filesystem>
#include <memory>

#include "cli/numbers.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"

namespace ravencal::commands {
namespace {

struct RecommendArguments {
  std::string folder;
  std::string json;
  double minutes = 0.0;
  study::Constraints constraints;
};

core::Status run(const RecommendArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(
      const study::Comparison comparison,
      study::read_comparison(std::filesystem::path(arguments.folder) / "compare.json"));
  study::Constraints constraints = arguments.constraints;
  if (arguments.minutes > 0.0) constraints.minutes = arguments.minutes;
  RAVENCAL_ASSIGN_OR_RETURN(const study::Recommendation recommendation,
                            study::recommend(comparison, constraints));
  core::say("{}", study::recommendation_text(recommendation, arguments.folder));
  if (arguments.json.empty()) return {};
  return core::write_whole_file(arguments.json, study::recommendation_json(recommendation));
}

}  // namespace

void add_recommend(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RecommendArguments>();
  CLI::App* command =
      app.add_subcommand("recommend", "Recommend one of the compared models, with reasons");
  command->add_option("folder", arguments->folder, "Folder that `ravencal compare --out` made")
      ->required();
  command
      ->add_option("--step-budget-us", arguments->constraints.step_budget_us,
                   "Time of one tick that a step may take at p99.9")
      ->check(cli::positive())
      ->capture_default_str();
  command
      ->add_option("--minutes", arguments->minutes,
                   "Minutes of zig-zag that you will record; default: as many as were compared")
      ->check(cli::positive());
  command->add_option("--json", arguments->json, "Write the recommendation to this file");
  command->footer("Example: ravencal recommend comparison --step-budget-us 100 --minutes 10");
  on_call(*command, exit_code, {.read = {"folder"}, .written = {"--json"}},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
