// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "prove/leak.hpp"

namespace ravencal::prove {

/// Opens the cases, checks every hash, scores, and writes proof.json and proof.html. The leak test
/// runs once, if it is asked for, and is kept. Errors: kData where anything differs from its seal.
core::Result<nlohmann::ordered_json> score_proof(const ProofOptions& options,
                                                 const std::optional<LeakOptions>& leak);

}  // namespace ravencal::prove
