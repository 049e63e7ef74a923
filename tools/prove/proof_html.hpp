// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace ravencal::prove {

/// proof.html from proof.json: one page that opens offline, figures as bars with intervals.
std::string proof_html(const nlohmann::ordered_json& proof);

}  // namespace ravencal::prove
