// SPDX-License-Identifier: Apache-2.0
//
// One weight at the tool loads every joint of the arm: what one drive takes for friction, a
// constant or a wrong number, all of them together weigh.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// The payload that explains what the drives show likelier than the names that each of them found
/// on its own; none if it does not, or if fewer than two drives would feel it. The effect is the
/// joint's that shows it most, its mass in kg with the interval in which the likelihood of all
/// joints together keeps within its 95 %. `drives[i]`, by which `findings[i]` were named, is null
/// for other channels.
std::optional<NamedEffect> payload_of_arm(const std::vector<std::unique_ptr<ChannelFit>>& drives,
                                          const std::vector<ChannelFindings>& findings,
                                          const ChannelOptions& options);

/// Loads every drive with it.
void hang(const NamedEffect& found, SeriesSet& set);

}  // namespace ravencal::diagnose
