// SPDX-License-Identifier: Apache-2.0
//
// What the channels of one joint say about each other.
#pragma once

#include <vector>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// What the drive's channel found about the joint's load belongs to the transmission's load as
/// well. One coefficient, two channels: the drive sees the effort itself, the cable only its
/// stretch.
void load_transmissions(SeriesSet& set, const std::vector<ChannelFindings>& findings);

/// Friction behind the cable shows twice: as a loop of the joint and as effort of the drive. Where
/// the loop names it with the level that the drive asks for, the drive's own entry says nothing
/// new.
void merge_joint_friction(const physics::Plant& plant, Report& report);

/// And where the loop is as the plant has it, though the cable would show what the drive asks for,
/// the friction is on the motor's side of the cable.
void move_friction_to_motor(const physics::Plant& plant, Report& report);

}  // namespace ravencal::diagnose
