// SPDX-License-Identifier: Apache-2.0
#include "physics/plant.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/robot_out.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "physics/drives.hpp"
#include "physics/plant_ranges.hpp"
#include "physics/plant_writer.hpp"
#include "physics/robot_model/tool_place.hpp"

namespace ravencal::commands {
namespace {

/// Far beyond any gearbox.
constexpr double kMostReduction = 1e5;

struct PlantArguments {
  std::string robot, plant, out, tool;
  std::vector<std::string> reductions, speeds;
};

/// What an option says of joints: `NUMBER` for all, or `JOINT=NUMBER`.
struct JointWord {
  std::string_view option, number, sample;  ///< `number`: what it is; `sample`: in capitals
  core::NumberRange range;
};

core::Status take_word(const std::string& word, const JointWord& kind, physics::Plant& plant,
                       const std::function<void(physics::Joint&, double)>& set) {
  const std::size_t equals = word.rfind('=');
  const bool of_one = equals != std::string::npos;
  const std::string name = word.substr(0, of_one ? equals : 0);
  const char* number = word.c_str() + (of_one ? equals + 1 : 0);
  double value = 0.0;
  const auto [end, error] = std::from_chars(number, word.data() + word.size(), value);
  if (error != std::errc{} || *end != '\0' || !(value >= kind.range.low) ||
      !(value <= kind.range.high))
    return core::usage_error(fmt::format("{} {}: wanted is {} of {:g} to {:g}, or JOINT={}",
                                         kind.option, word, kind.number, kind.range.low,
                                         kind.range.high, kind.sample));
  if (of_one && !plant.joint_index(name)) {
    std::vector<std::string> names;
    for (const physics::Joint& joint : plant.joints) names.push_back(joint.name);
    return core::usage_error(fmt::format("{} {}: {} has no joint '{}', but {}", kind.option, word,
                                         plant.source, name, fmt::join(names, ", ")));
  }
  for (physics::Joint& joint : plant.joints)
    if (!of_one || joint.name == name) set(joint, value);
  return {};
}

core::Status import_robot(const PlantArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(physics::Plant plant, physics::load_plant(arguments.robot));
  for (const std::string& word : arguments.reductions)
    RAVENCAL_RETURN_IF_ERROR(take_word(
        word, {"--reduction", "a ratio", "RATIO", {1.0, kMostReduction}}, plant,
        [](physics::Joint& joint, double ratio) { physics::set_reduction(joint, ratio); }));
  for (const std::string& word : arguments.speeds)
    RAVENCAL_RETURN_IF_ERROR(take_word(
        word, {"--speed", "a speed in rad/s or m/s", "SPEED", physics::kSpeedRange}, plant,
        [](physics::Joint& joint, double speed) { joint.limits.speed_ji = speed; }));
  if (!arguments.tool.empty())
    RAVENCAL_RETURN_IF_ERROR(physics::hang_payload_at(arguments.tool, arguments.robot, plant));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(arguments.out, physics::plant_text(plant)));
  core::say("{}{}: {} joints\n", physics::describe_plant(plant), arguments.out,
            plant.joints.size());
  for (const std::string& note : plant.notes) core::say("note: {}\n", note);
  core::say(
      "Before a diagnosis, state what the model does not: [joint.tolerance], the encoders' "
      "resolutions, the reductions.\n");
  return {};
}

core::Status export_robot(const PlantArguments& arguments) {
  if (!physics::is_robot_model(arguments.robot))
    return core::usage_error(
        fmt::format("--model {}: is neither .xml (MJCF) nor .urdf", arguments.robot));
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(arguments.plant));
  RAVENCAL_ASSIGN_OR_RETURN(const physics::WrittenRobot written,
                            physics::write_robot(plant, arguments.robot, arguments.out));
  RAVENCAL_RETURN_IF_ERROR(physics::save_robot(written, arguments.out));
  for (const std::string& line : written.changed) core::say("{}\n", line);
  print_model(written, arguments.out);
  return {};
}

cli::Paths callback_beside(const CLI::App& command) {
  return {physics::callback_path(cli::path_of(command, "--out"))};
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
  from->add_option("--speed", arguments->speeds,
                   "Greatest speed of a joint, rad/s or m/s, which no MJCF says and trajectories "
                   "need: SPEED for all joints, JOINT=SPEED for one; may be given several times");
  from->add_option("--tool", arguments->tool,
                   "Site or body on the last link where a payload hangs; without it, the body that "
                   "this link carries farthest from its joint");
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
  to->footer(
      "Example: ravencal plant to why/plant_improved.toml --model so_arm100.xml --out "
      "so_arm100_improved.xml\n"
      "What the format cannot say is listed; OUT_effects.cpp holds what a callback of MuJoCo can.");
  const FileOptions files = {.read = {"plant", "--model"},
                             .written = {"--out"},
                             .also_written = callback_beside,
                             .together = true};
  on_call(*to, exit_code, files, [arguments] { return export_robot(*arguments); });
  command->footer("Example: ravencal plant from so_arm100.xml --out so_arm100.toml");
}

}  // namespace ravencal::commands
