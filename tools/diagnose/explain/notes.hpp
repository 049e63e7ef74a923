// SPDX-License-Identifier: Apache-2.0
//
// What has to be said of the channels: nothing is left out in silence.
#pragma once

#include <string>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "diagnose/model/likelihood.hpp"
#include "diagnose/track/input.hpp"

namespace ravencal::diagnose {

/// Recordings that have nothing to say of a channel, channels of which no held-out row tells, and
/// signals that the plant's effects follow and nobody recorded. `shown`: held-out rows; null:
/// there are none.
std::vector<std::string> channel_notes(const Likelihood& fitted, const Likelihood* shown,
                                       const Recordings& training, const Recordings& held_out,
                                       const physics::Plant& plant);

/// By which way cables go of which the plant does not say it.
std::vector<std::string> routing_notes(const std::vector<Routing>& routings);

}  // namespace ravencal::diagnose
