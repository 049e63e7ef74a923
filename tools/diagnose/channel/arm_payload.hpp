// SPDX-License-Identifier: Apache-2.0
//
// One weight at the tool loads every joint of the arm: what one drive takes for friction, a
// constant or a wrong number, all of them together weigh.
#pragma once

#include <optional>
#include <vector>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// The payload that explains what the drives show likelier than the names that each of them found
/// on its own; none if it does not, or if fewer than two drives would feel it. The effect is the
/// joint's that shows it most, its mass in kg with the interval in which the likelihood of all
/// joints together keeps within its 95 %.
std::optional<NamedEffect> payload_of_arm(const SeriesSet& set, const physics::Plant& plant,
                                          const ChannelOptions& options,
                                          const std::vector<ChannelFindings>& findings);

/// Loads every drive with it.
void hang(const NamedEffect& found, SeriesSet& set);

}  // namespace ravencal::diagnose
