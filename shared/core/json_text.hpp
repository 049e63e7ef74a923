// SPDX-License-Identifier: Apache-2.0
//
// JSON of files from outside. The library parses any depth, but copies, prints and frees what it
// parsed by calls within calls, so that deep nesting would end on the stack. Any thread.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::core {

/// Lists and objects within each other; the project's own files nest 6 deep.
inline constexpr int kDeepestJson = 64;

/// Errors: kData, a sentence without the file's name.
template <typename Json = nlohmann::json>
Result<Json> parse_json(std::string_view text) {
  bool too_deep = false;
  const auto watch = [&](int depth, nlohmann::json::parse_event_t, Json&) {
    too_deep = too_deep || depth > kDeepestJson;
    return !too_deep;
  };
  Json parsed = Json::parse(text, watch, false);
  if (too_deep) return data_error(fmt::format("nests JSON more than {} deep", kDeepestJson));
  if (parsed.is_discarded()) return data_error("is not JSON");
  return parsed;
}

}  // namespace ravencal::core
