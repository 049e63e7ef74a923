// SPDX-License-Identifier: Apache-2.0
//
// raven_state as it is published: degrees, metres times 180/pi, micrometres, counts, float32.
// Field by field after uw-biorobotics/raven2 src/raven/local_io.cpp (publish_ravenstate_ros).
#pragma once

#include <array>

#include "core/catalogue.hpp"
#include "physics/raven_controller.hpp"

namespace ravencal::physics {

using RavenMessage = std::array<double, core::kCatalogueSize>;

/// What the controller has read of `arm` by the time of the plugin's hook: encoders, motor and
/// joint positions and velocities.
void write_sensor_fields(const ArmState& arm, bool other_arm, RavenMessage& message);

/// What the controller computes after the hook: torque, DAC, desired values, pose, Jacobian.
void write_control_fields(const ArmState& arm, bool other_arm, RavenMessage& message);

/// raven_state takes some fields of its slots from mech[0] and mech[1] and the others from the
/// joints' types (local_io.cpp, publish_ravenstate_ros): with the green arm as mech[0], type, pose,
/// desired pose, grasp and Jacobian of each arm stand in the other arm's slots.
void swap_mechanism_fields(RavenMessage& message);

/// Time [s] and run levels; no teleoperation packet has ever arrived (last_seq 111).
void write_status_fields(double time_s, int runlevel, int sublevel, RavenMessage& message);

/// The DAC values are zero at the hook: the controller clears them at the start of its cycle.
void clear_dac_fields(RavenMessage& message);

}  // namespace ravencal::physics
