// SPDX-License-Identifier: Apache-2.0
//
// Steps of the transmission as part of a model. They are looked for before the effects: a step
// bends whatever is fitted beside it.
#pragma once

#include <cstdint>
#include <optional>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// The model with the steps that stand out of what its saturated form leaves, or with one so large
/// that it hides; nothing where none is suspected.
std::optional<ChannelModel> with_steps(const ChannelModel& model);

/// The model without one of its steps.
ChannelModel without_step(const ChannelModel& model, std::size_t step);

/// Drops steps whose gain is not repeated in held-out blocks, and those that say no more than a
/// constant of the whole stretch that they are in.
void drop_unproven_steps(ChannelModel& model, const Gates& gates, std::uint64_t seed);

}  // namespace ravencal::diagnose
