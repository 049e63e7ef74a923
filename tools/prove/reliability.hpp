// SPDX-License-Identifier: Apache-2.0
//
// Whether probabilities mean what they say: of the names said with 90 %, 90 % should be there.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prove/score.hpp"

namespace ravencal::prove {

/// One entry per world and range of the probability said, in rising order: how many physics were
/// named with it, the mean of what was said, and how many of them were hidden at that joint.
nlohmann::ordered_json reliability_json(const std::vector<CaseScore>& scores);

/// The same as lines for a terminal; empty where no report said a probability.
std::string reliability_text(const nlohmann::ordered_json& reliability);

}  // namespace ravencal::prove
