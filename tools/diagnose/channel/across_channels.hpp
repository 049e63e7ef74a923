// SPDX-License-Identifier: Apache-2.0
//
// What the channels of one joint say about each other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// What the drive's channel found about the joint's load belongs to the transmission's load as
/// well. One coefficient, two channels: the drive sees the effort itself, the cable only its
/// stretch.
void load_transmissions(SeriesSet& set, const std::vector<ChannelFindings>& findings);

/// The plant with the friction behind that joint's cable which the joint's loop names; empty where
/// it names none. `level` as the transmission's findings have it.
std::optional<physics::Plant> with_friction_of_loop(const physics::Plant& plant,
                                                    const std::vector<ChannelFindings>& findings,
                                                    const std::string& joint);

/// A drive's findings beside that friction (plant `agreed`) if they are fewer than those of the
/// plant as it is, else those: one cause that shows in both channels is likelier than two. What the
/// plant leaves of the error at first stays what it was.
ChannelFindings fewer_beside_friction(const Series& drive, const physics::Plant& agreed,
                                      ChannelFindings alone, const ChannelOptions& options);

/// Friction behind the cable shows twice: as a loop of the joint and as effort of the drive. Where
/// the loop names it with the level that the drive asks for, the drive's own entry says nothing
/// new.
void merge_joint_friction(const physics::Plant& plant, Report& report);

/// And where the loop is as the plant has it, though the cable would show what the drive asks for,
/// the friction is on the motor's side of the cable.
void move_friction_to_motor(const physics::Plant& plant,
                            const std::vector<ChannelFindings>& findings, Report& report);

}  // namespace ravencal::diagnose
