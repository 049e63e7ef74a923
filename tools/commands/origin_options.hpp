// SPDX-License-Identifier: Apache-2.0
//
// --robot, --controller and --coordinates: what a file does not say of where it comes from.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "model/calibration_model.hpp"

namespace ravencal::commands {

struct OriginOptions {
  std::string robot;
  std::string controller;
  std::string coordinates;
};

/// Adds the three options; --arm is that of add_load_options.
void add_origin_options(CLI::App& command, OriginOptions& options);

/// What the user said; the arm only if `command` was given --arm.
model::Origin given_origin(const CLI::App& command, const OriginOptions& options);

/// Prints the origin, and which options would state what is unknown and a plugin asks for.
void print_origin(const model::CalibrationModel& model);

}  // namespace ravencal::commands
