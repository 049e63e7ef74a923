// SPDX-License-Identifier: Apache-2.0
//
// Which way the cables go that other joints move, where the plant does not say.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// Ways of the plant's coupled cables whose transmissions were recorded: as the plant says, or as
/// the fits of all transmissions together prefer; one of `fits` per series, empty where there is
/// none. A way is decided where it is so likely that a name would be given for as much.
std::vector<Routing> routings_of(const SeriesSet& set, const std::vector<NamedChannel>& fits,
                                 const physics::Plant& plant);

/// True if the channel's model holds both ways of some cable.
bool admits_both(const Series& series);

/// Takes what was decided into the series: loads that cables carry and stretch that they inherit.
/// Returns for each series whether it changed.
std::vector<char> route(const std::vector<Routing>& routings, SeriesSet& set);

/// What was taken, and how sure it is; empty where the plant says it.
std::string sentence_for(const Routing& routing);

}  // namespace ravencal::diagnose
