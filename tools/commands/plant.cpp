// SPDX-License-Identifier: Apache-2.0
#include "physics/plant.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/robot_out.hpp"
#include "core/whole_file.hpp"
#include "physics/drives.hpp"
#include "physics/plant_writer.hpp"
#include "physics/robot_model/tool_place.hpp"

namespace ravencal::commands {
namespace {

/// Far beyond any gearbox.
constexpr double kMostReduction = 1e5;

struct PlantArguments {
  std::string robot, plant, out, tool;
  std::vector<std::string> reductions;
  bool force = false;
};

/// `RATIO` for all joints or `JOINT=RATIO`.
core::Status take_reduction(const std::string& word, physics::Plant& plant) {
  const std::size_t equals = word.rfind('=');
  const bool of_one = equals != std::string::npos;
  const std::string name = word.substr(0, of_one ? equals : 0);
  const char* number = word.c_str() + (of_one ? equals + 1 : 0);
  double ratio = 0.0;
  const auto [end, error] = std::from_chars(number, word.data() + word.size(), ratio);
  if (error != std::errc{} || *end != '\0' || !(ratio >= 1.0) || !(ratio <= kMostReduction))
    return core::usage_error(
        fmt::format("--reduction {}: wanted is a ratio of 1 to {:g}, or "
                    "JOINT=RATIO",
                    word, kMostReduction));
  if (of_one && !plant.joint_index(name)) {
    std::vector<std::string> names;
    for (const physics::Joint& joint : plant.joints) names.push_back(joint.name);
    return core::usage_error(fmt::format("--reduction {}: {} has no joint '{}', but {}", word,
                                         plant.source, name, fmt::join(names, ", ")));
  }
  for (physics::Joint& joint : plant.joints)
    if (!of_one || joint.name == name) physics::set_reduction(joint, ratio);
  return {};
}

core::Status import_robot(const PlantArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(physics::Plant plant, physics::load_plant(arguments.robot));
  for (const std::string& word : arguments.reductions)
    RAVENCAL_RETURN_IF_ERROR(take_reduction(word, plant));
  if (!arguments.tool.empty())
    RAVENCAL_RETURN_IF_ERROR(physics::hang_payload_at(arguments.tool, arguments.robot, plant));
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

core::Status export_robot(const PlantArguments& arguments) {
  if (!physics::is_robot_model(arguments.robot))
    return core::usage_error(
        fmt::format("--model {}: is neither .xml (MJCF) nor .urdf", arguments.robot));
  if (std::filesystem::exists(arguments.out) && !arguments.force)
    return core::usage_error(fmt::format("{}: exists; --force replaces it", arguments.out));
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.plant));
  RAVENCAL_ASSIGN_OR_RETURN(const physics::WrittenRobot written,
                            physics::write_robot(plant, arguments.robot, arguments.out));
  RAVENCAL_RETURN_IF_ERROR(physics::save_robot(written, arguments.out));
  for (const std::string& line : written.changed) fmt::print("{}\n", line);
  print_model(written, arguments.out);
  return {};
}

}  // namespace

void add_plant(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<PlantArguments>();
  CLI::App* command = app.add_subcommand(
      "plant", "Make a plant from a robot model of others, and write one back into it");
  command->require_subcommand(1);
  CLI::App* from = command->add_subcommand("from", "From MJCF (.xml) or URDF (.urdf)");
  from->add_option("robot", arguments->robot, "The model; files that it includes are read as well")
      ->required();
  from->add_option("--out", arguments->out, "Plant to write (.toml)")->required();
  from->add_option("--reduction", arguments->reductions,
                   "Turns of the motor per turn of the joint, which no MJCF says: RATIO for all "
                   "joints, JOINT=RATIO for one; may be given several times");
  from->add_option("--tool", arguments->tool,
                   "Site or body on the last link where a payload hangs; without it, the body that "
                   "this link carries farthest from its joint");
  from->add_flag("--force", arguments->force, "Replace an existing file");
  from->footer(
      "Example: ravencal plant from so_arm100.xml --reduction 345 --reduction jaw=191 --out "
      "so_arm100.toml");
  on_call(*from, exit_code, {.read = {"robot"}, .written = {"--out"}},
          [arguments] { return import_robot(*arguments); });
  CLI::App* to = command->add_subcommand("to", "Write a plant into the model it was made from");
  to->add_option("plant", arguments->plant, "The plant (.toml), e.g. plant_improved.toml")
      ->required();
  to->add_option("--model", arguments->robot, "The model that the plant was made from")->required();
  to->add_option("--out", arguments->out, "Model to write (.xml, .urdf as --model)")->required();
  to->add_flag("--force", arguments->force, "Replace an existing file");
  to->footer(
      "Example: ravencal plant to why/plant_improved.toml --model so_arm100.xml --out "
      "so_arm100_improved.xml\n"
      "What the format cannot say is listed; OUT_effects.cpp holds what a callback of MuJoCo can.");
  on_call(*to, exit_code, {.read = {"plant", "--model"}, .written = {"--out"}},
          [arguments] { return export_robot(*arguments); });
  command->footer("Example: ravencal plant from so_arm100.xml --out so_arm100.toml");
}

}  // namespace ravencal::commands
