// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "prove/leak.hpp"

namespace ravencal::prove {

/// Opens the cases, checks every hash, scores, and writes proof.json and proof.html. The leak test
/// runs once, if it is asked for, and is kept. Errors: kData where anything differs from its seal.
core::Result<nlohmann::ordered_json> score_proof(const ProofOptions& options,
                                                 const std::optional<LeakOptions>& leak);

/// proof.html: one page that opens offline, drawn by page.js from proof.json, which it holds.
std::string proof_html(const nlohmann::ordered_json& proof);

}  // namespace ravencal::prove
