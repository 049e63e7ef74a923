// SPDX-License-Identifier: Apache-2.0
//
// From scored cases to figures with intervals, and to the proof's targets, met or not.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prove/score.hpp"

namespace ravencal::prove {

/// proof.json: see README of the folder that `ravencal prove` writes, in the key "reading".
nlohmann::ordered_json tally(const std::vector<CaseScore>& scores);

/// The targets as lines for a terminal.
std::string targets_text(const nlohmann::ordered_json& proof);

}  // namespace ravencal::prove
