// SPDX-License-Identifier: Apache-2.0
//
// What of the recordings could be compared with the plant, and why the rest could not.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "diagnose/model/likelihood.hpp"
#include "diagnose/track/input.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Adds recordings that have nothing to say of a channel, channels of which no held-out row tells,
/// and signals that the plant's effects follow and nobody recorded. `held_out`: null: none. `all`:
/// recordings in the order of Track::recording.
void add_channel_notes(const Likelihood& fitted, const Likelihood* held_out,
                       const std::vector<const record::Recording*>& all,
                       const physics::Plant& plant, std::vector<std::string>& notes);

/// Every channel that has used rows, and every stage of a joint that has none. Motion and load are
/// those of the rows that were fitted. `held_out`: of the same channels; null: none.
void add_looked_at(const Likelihood& fitted, const Likelihood* held_out,
                   const physics::Plant& given, Report& report);

/// Why that stage ("command", "drive"; anything else is behind the motor) of a joint was not looked
/// at.
std::string why_not(const Likelihood& fitted, std::size_t joint, std::string_view stage);

}  // namespace ravencal::diagnose
