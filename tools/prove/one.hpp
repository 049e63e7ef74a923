// SPDX-License-Identifier: Apache-2.0
//
// What the one case of `prove --one` hid against what its diagnosis found.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "prove/proof.hpp"

namespace ravencal::prove {

/// one.json of an opened case with one effect; shared/schemas/one.schema.json has its fields.
/// Errors: kData if the case hides another number of effects.
core::Result<nlohmann::ordered_json> one_json(const OpenedCase& opened);

/// Two lines, what was hidden and what was found, and one that judges.
std::string one_text(const nlohmann::ordered_json& one);

}  // namespace ravencal::prove
