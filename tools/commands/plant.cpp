// SPDX-License-Identifier: Apache-2.0
#include "physics/plant.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/whole_file.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::commands {
namespace {

struct PlantArguments {
  std::string robot, out;
  bool force = false;
};

core::Status import_robot(const PlantArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.robot));
  if (std::filesystem::exists(arguments.out) && !arguments.force)
    return core::usage_error(fmt::format("{}: exists; --force replaces it", arguments.out));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(arguments.out, physics::plant_text(plant)));
  fmt::print("{}{}: {} joints\n", physics::describe_plant(plant), arguments.out,
             plant.joints.size());
  for (const std::string& note : plant.notes) fmt::print("note: {}\n", note);
  fmt::print(
      "Before a diagnosis, state what the model does not: [joint.tolerance], the encoders' "
      "resolutions, the reductions.\n");
  return {};
}

}  // namespace

void add_plant(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<PlantArguments>();
  CLI::App* command = app.add_subcommand("plant", "Make a plant from a robot model of others");
  command->require_subcommand(1);
  CLI::App* from = command->add_subcommand("from", "From MJCF (.xml) or URDF (.urdf)");
  from->add_option("robot", arguments->robot, "The model; files that it includes are read as well")
      ->required();
  from->add_option("--out", arguments->out, "Plant to write (.toml)")->required();
  from->add_flag("--force", arguments->force, "Replace an existing file");
  from->footer("Example: ravencal plant from so_arm100.xml --out so_arm100.toml");
  on_call(*from, exit_code, {.read = {"robot"}, .written = {"--out"}},
          [arguments] { return import_robot(*arguments); });
  command->footer("Example: ravencal plant from so_arm100.xml --out so_arm100.toml");
}

}  // namespace ravencal::commands
