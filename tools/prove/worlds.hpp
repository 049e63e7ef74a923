// SPDX-License-Identifier: Apache-2.0
//
// Shows figures of the worlds side by side: a diagnosis that fits one set of laws alone does worse
// on the other.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prove/score.hpp"

namespace ravencal::prove {

/// {world: {"cases", "targets"}} of the synthetic cases, targets as tally() gives them.
nlohmann::ordered_json worlds_json(const std::vector<CaseScore>& scores);

/// The field `worlds` of proof.json as lines for a terminal; empty where it is absent.
std::string worlds_text(const nlohmann::ordered_json& proof);

}  // namespace ravencal::prove
