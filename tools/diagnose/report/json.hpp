// SPDX-License-Identifier: Apache-2.0
//
// report.json before it is text. Numbers that are not finite become null in the text.
#pragma once

#include <optional>

#include <nlohmann/json.hpp>

#include "diagnose/findings/findings.hpp"

/// Writes these members of a type, each under its own name, in this order.
#define RAVENCAL_JSON_MEMBERS(Type, ...)                                               \
  void to_json(nlohmann::ordered_json& nlohmann_json_j, const Type& nlohmann_json_t) { \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_TO, __VA_ARGS__))           \
  }

/// Null where it is not known.
template <typename T>
struct nlohmann::adl_serializer<std::optional<T>> {
  static void to_json(ordered_json& json, const std::optional<T>& value) {
    json = value ? ordered_json(*value) : ordered_json(nullptr);
  }
};

namespace ravencal::diagnose {

using Json = nlohmann::ordered_json;

Json report_document(const Report& report);

}  // namespace ravencal::diagnose
