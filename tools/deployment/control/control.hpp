// SPDX-License-Identifier: Apache-2.0
//
// Asks a running plugin for a mode, a share, a reset or the constant of a homing, in the memory
// that it shows to programs of its own user (ravencal/control.h). The control loop notices nothing
// but one word that changed.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "ravencal/control.h"

namespace ravencal::control {

/// What is asked for.
struct Request {
  std::uint32_t kind = RAVENCAL_REQUEST_OFF;  ///< RAVENCAL_REQUEST_*
  float share = 1.0F;                         ///< 0..1; of _SHARE alone
  std::uint32_t joints = 7;                   ///< bit j: joint j; of _SHARE alone
  ravencal_homing_constant constant{};        ///< of _HOMING_CONSTANT alone
  bool stays = true;  ///< where it waits for the pedal, it lies there after ask() has returned
};

enum class Answer {
  kTaken,
  kWaitsForPedal,  ///< the pedal is down: it lies there until it is up
  // With all others nothing of it is left: it is not taken later.
  kOtherWaits,  ///< not asked: an earlier request still waits for the pedal
  kOvertaken,   ///< another program asked meanwhile, and perhaps before the plugin looked
  kNotTaken,    ///< nobody took it in time
  kStands,      ///< the control loop does not run
};

/// Asks the plugin whose telemetry has that name and waits up to `wait_s` for it to take the
/// request. "off" and "reset" are written again where another program wrote over them. Errors:
/// those of TelemetryReader::open; kIo where telemetry or memory belong to another user, or the
/// controller ended meanwhile. Stops waiting where `keep_going` is false.
core::Result<Answer> ask(const std::string& name, const Request& request, double wait_s,
                         const std::function<bool()>& keep_going);

/// The answer as a sentence; `wait_s`: how long was waited.
std::string sentence_of(Answer answer, double wait_s);

/// Names of the telemetry of this user's plugins, in order.
std::vector<std::string> own_names();

}  // namespace ravencal::control
