// SPDX-License-Identifier: Apache-2.0
//
// The search for a channel's effects. A climb adds the likeliest admissible effect, or two that
// hide each other, until none is left, and drops what later ones made superfluous. Where it ends
// above the noise, it may have begun with an effect that imitates several, so that the next
// likeliest beginnings are climbed as well. The model with the least penalised score is the result.
#pragma once

#include <cstdint>
#include <vector>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// Models that admit no further effect, all effects through their gates; likeliest first.
std::vector<ChannelModel> search_effects(const ChannelModel& start, const Gates& gates,
                                         std::uint64_t seed);

/// Adds the effects of the likeliest model.
void select_effects(ChannelModel& model, const Gates& gates, std::uint64_t seed);

/// Least penalised score first, in the unit of the least noise.
void sort_by_score(std::vector<ChannelModel>& models);

}  // namespace ravencal::diagnose
