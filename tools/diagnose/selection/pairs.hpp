// SPDX-License-Identifier: Apache-2.0
//
// Two effects at once, where none enters alone.
#pragma once

#include <cstdint>
#include <vector>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// Two effects may hide each other: where they act against each other neither explains anything
/// alone, and where one acts, blocks differ by what the other does. Of all pairs that the model
/// offers the likeliest, if it is clearly likelier than none; one of the two passes its gates
/// beside the other. Candidates that were `dropped` take no part. Empty if there is none.
std::vector<Chosen> pick_pair(const ChannelModel& model, const std::vector<std::size_t>& dropped,
                              const Gates& gates, std::uint64_t seed);

}  // namespace ravencal::diagnose
