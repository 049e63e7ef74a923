// SPDX-License-Identifier: Apache-2.0
#include "commands/origin_options.hpp"

#include "core/catalogue.hpp"
#include "core/terminal.hpp"

namespace ravencal::commands {

void add_origin_options(CLI::App& command, OriginOptions& options) {
  command.add_option("--robot", options.robot, "The robot's name, where the file has none");
  command.add_option(
      "--controller", options.controller,
      "Branch or control mode of the controller during the recording, e.g. main or crtk");
  command
      .add_option("--coordinates", options.coordinates,
                  "motor: recorded without the plugin, or while it was off; corrected: recorded "
                  "while it corrected. A file from a robot does not say this")
      ->check(CLI::IsMember({"motor", "corrected"}));
}

model::Origin given_origin(const CLI::App& command, const OriginOptions& options) {
  model::Origin origin;
  origin.robot = options.robot;
  origin.controller = options.controller;
  origin.coordinates =
      model::coordinates_from(options.coordinates).value_or(model::Coordinates::kUnknown);
  const CLI::Option* arm = command.get_option_no_throw("--arm");
  if (arm != nullptr && arm->count() > 0) {
    origin.arm = model::arm_from(arm->as<std::string>()).value_or(model::Arm::kUnknown);
  }
  return origin;
}

void print_origin(const model::CalibrationModel& model) {
  const model::Origin& origin = model.origin;
  core::say("origin: {}\n", describe(origin));
  const bool is_raven =
      core::catalogue_index_of(model.outputs.front().estimate_channel).has_value();
  if (!is_raven) return;  // only a plugin asks which arm it was
  if (origin.arm == model::Arm::kUnknown || origin.coordinates == model::Coordinates::kUnknown) {
    core::say(
        "        state what is unknown, so that no other arm loads these weights: --arm "
        "gold|green, --coordinates motor (recorded without the plugin) or corrected (while it "
        "corrected)\n");
  }
}

}  // namespace ravencal::commands
