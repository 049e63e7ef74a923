// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt_plugin/instance.hpp"

namespace ravencal::rt {

/// [rt] One control cycle: state in, corrected joints out. Returns RAVENCAL_OK, _HELD, _BYPASS or
/// _FAULT.
std::int32_t step(ravencal_instance& self, const ravencal_state& state,
                  ravencal_output& output) noexcept;

/// [rt] Before the inverse cable coupling: the desired joints without the correction that is in
/// them.
JointVector motor_command_ji(ravencal_instance& self, const JointVector& desired_ji) noexcept;

/// [rt] Keeps what the controller published: the next step reads torque, DAC, desired values and
/// pose from it.
void observe_cycle_end(ravencal_instance& self, const ravencal_state& state) noexcept;

}  // namespace ravencal::rt
