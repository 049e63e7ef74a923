// SPDX-License-Identifier: Apache-2.0
//
// report.json before it is text, and its parts.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

using Json = nlohmann::ordered_json;

/// Null where it is not known.
inline Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
inline Json number(const std::optional<double>& value) {
  return value ? number(*value) : Json(nullptr);
}
inline Json interval(const Interval& i) { return {number(i.first), number(i.second)}; }
inline Json interval(const std::optional<Interval>& i) { return i ? interval(*i) : Json(nullptr); }

/// All of it.
Json report_document(const Report& report);

/// What is drawn of each channel; series with five significant digits.
Json channels_json(const Report& report);
/// Every candidate with its gates.
Json candidates_json(const Report& report);
/// What each channel saw, and the stages that none shows.
Json looked_at_json(const Report& report);
Json not_looked_at_json(const Report& report);
/// One sentence per joint, the chain of each, the causes.
Json joints_json(const Report& report);
Json chain_json(const Report& report);
Json causes_json(const Report& report);

}  // namespace ravencal::diagnose
