// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "core/result.hpp"
#include "ravencal/control.h"

namespace ravencal::rezero {

/// What became of a constant that a running plugin was asked to take.
struct HandedOver {
  bool is_well = false;  ///< it is in force, or is taken when the pedal is up
  std::string sentence;
};

/// Asks the plugin with that telemetry for the constant and looks whether it is in force then; one
/// without weights ends what is. Waits up to `wait_s`. Errors: those of control::ask.
core::Result<HandedOver> hand_over(const std::string& name,
                                   const ravencal_homing_constant& constant, double wait_s,
                                   const std::function<bool()>& keep_going);

}  // namespace ravencal::rezero
