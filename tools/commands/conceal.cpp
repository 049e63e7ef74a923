// SPDX-License-Identifier: Apache-2.0
#include "conceal/conceal.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/interrupt.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "conceal/kinds.hpp"
#include "core/temporary_folder.hpp"
#include "core/whole_file.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::commands {
namespace {

struct ConcealArguments {
  std::string plant;
  std::string trajectory;
  std::string out;
  std::string answer;
  std::uint64_t seed = 1;
  bool overwrite = false;
};

std::string ids() {
  std::string list;
  for (const conceal::Kind& kind : conceal::kinds())
    list += (list.empty() ? "" : ", ") + std::string(kind.id);
  return list;
}

core::Status run(const ConcealArguments& arguments) {
  for (const std::string& file : {arguments.out, arguments.answer}) {
    if (!arguments.overwrite && std::filesystem::exists(file)) {
      return core::Error{core::ErrorCode::kUsage,
                         fmt::format("{}: exists already; use --force to replace it", file)};
    }
  }
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.plant));
  RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory motion,
                            trajectory::read_csv(arguments.trajectory));
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder scratch, core::TemporaryFolder::create());
  cli::catch_interrupts_of_work();
  RAVENCAL_ASSIGN_OR_RETURN(
      const conceal::Hidden hidden,
      conceal::conceal(plant, motion, arguments.seed, scratch.path() / "session.db",
                       [] { return !cli::interrupted(); }));
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text,
                            conceal::hidden_plant(arguments.plant, plant, hidden));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(arguments.out, text));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(
      arguments.answer, conceal::answer_json(plant, hidden, arguments.seed)));
  fmt::print("{}: {} with one effect more, seed {}; what it is stands in {}\n", arguments.out,
             arguments.plant, arguments.seed, arguments.answer);
  return {};
}

}  // namespace

void add_conceal(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ConcealArguments>();
  CLI::App* command = app.add_subcommand(
      "conceal", "Hide one effect in a plant, to see what `diagnose` makes of it");
  command->add_option("--plant", arguments->plant, "Plant of a RAVEN arm (.toml)")->required();
  command
      ->add_option(
          "--trajectory", arguments->trajectory,
          "Motion for which the size is chosen: as will be recorded, half a minute or more")
      ->required();
  command->add_option("--out", arguments->out, "Plant with the effect in it")->required();
  command->add_option("--answer", arguments->answer, "What is hidden (.json), for `reveal`")
      ->required();
  command->add_option("--seed", arguments->seed, "Of the draw; the same seed hides the same")
      ->capture_default_str();
  command->add_flag("--force", arguments->overwrite, "Replace existing files");
  command->footer(fmt::format(
      "Hides one of {}. Those that some joint lacks are as likely, and so is any joint that lacks "
      "it.\n"
      "The size is what the twin shows of it in that motion: {:g} to {:g} times what two runs of "
      "the\n"
      "plant differ by, even in the logarithm; less where more would stop the arm. Where no size "
      "shows\n"
      "so much, another is drawn. The kinds are those that diagnose can name, and twin and "
      "diagnose\n"
      "share their physics: this is a demonstration; the proof is `prove`.\n"
      "Example: ravencal conceal --plant tools/plants/raven2_published.toml --trajectory run.csv "
      "--seed 7 --out hidden.toml --answer answer.json",
      ids(), conceal::kLeastSize, conceal::kMostSize));
  on_call(*command, exit_code,
          {.read = {"--plant", "--trajectory"}, .written = {"--out", "--answer"}},
          [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
