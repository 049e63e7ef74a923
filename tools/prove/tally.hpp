// SPDX-License-Identifier: Apache-2.0
//
// Computes figures with intervals from scored cases, and whether the targets are met.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prove/score.hpp"

namespace ravencal::prove {

/// proof.json without `seal` and `leak_test`; shared/schemas/proof.schema.json has its fields.
nlohmann::ordered_json tally(const std::vector<CaseScore>& scores);

/// The targets as lines for a terminal.
std::string targets_text(const nlohmann::ordered_json& proof);

}  // namespace ravencal::prove
