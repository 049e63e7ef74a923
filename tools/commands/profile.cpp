// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "guess/guess.hpp"
#include "physics/plant.hpp"
#include "record/plausibility.hpp"

namespace ravencal::commands {
namespace {

struct ProfileArguments {
  std::string data, plant, out;
  record::LoadOptions load;
};

/// What an import through the new profile would refuse or doubt.
std::vector<std::string> doubts_of(const ProfileArguments& arguments) {
  record::LoadOptions load = arguments.load;
  load.profile = arguments.out;
  const auto recording = exchange::load_recording(arguments.data, load);
  if (!recording.ok()) return {recording.error().message};
  std::vector<std::string> sentences;
  for (const record::Implausibility& doubt : record::implausibilities(*recording))
    sentences.push_back(doubt.sentence);
  return sentences;
}

core::Status guess(const ProfileArguments& arguments) {
  std::vector<std::string> joints;
  if (!arguments.plant.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.plant));
    for (const physics::Joint& joint : plant.joints) joints.push_back(joint.name);
  }
  RAVENCAL_ASSIGN_OR_RETURN(const record::Table table,
                            exchange::read_table(arguments.data, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(const guess::Guess guessed, guess::guess_profile(table, joints));
  core::say("{}", guess::describe(guessed, table));
  if (!table.note.empty()) core::say("{}\n", table.note);
  if (arguments.out.empty()) return {};
  RAVENCAL_RETURN_IF_ERROR(
      core::write_whole_file(arguments.out, guess::profile_text(guessed, table)));
  core::say("{}: correct what is wrong, then read the data with --profile {}\n", arguments.out,
            arguments.out);
  print_warnings(doubts_of(arguments));
  return {};
}

}  // namespace

void add_profile(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ProfileArguments>();
  CLI::App* command = app.add_subcommand("profile", "Say what the columns of a foreign file are");
  command->require_subcommand(1);
  CLI::App* from = command->add_subcommand(
      "guess", "Write a profile by the columns' names and values, with what is to be checked");
  from->add_option("data", arguments->data, "Table to read (.csv, .npz, ...)")->required();
  from->add_option("--plant", arguments->plant,
                   "Plant or robot model (.toml, .xml, .urdf) whose joints are meant");
  from->add_option("--out", arguments->out, "Profile to write (.toml); without, it is only shown");
  add_skip_bad(*from, arguments->load);
  from->footer("Example: ravencal profile guess run1.csv --plant robot.xml --out run.toml");
  on_call(*from, exit_code, {.read = {"data", "--plant"}, .written = {"--out"}},
          [arguments] { return guess(*arguments); });
  command->footer("Example: ravencal profile guess run1.csv --out run.toml");
}

}  // namespace ravencal::commands
