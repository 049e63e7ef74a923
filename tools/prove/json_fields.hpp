// SPDX-License-Identifier: Apache-2.0
//
// Fields of documents that others wrote, with a fallback where one is absent or of another type;
// private to prove/.
#pragma once

#include <string>

#include "prove/workspace.hpp"

namespace ravencal::prove {

inline double number(const Json& json, const char* key, double fallback = 0.0) {
  const auto it = json.find(key);
  return it != json.end() && it->is_number() ? it->get<double>() : fallback;
}
inline std::string text(const Json& json, const char* key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
}
inline const Json& list(const Json& json, const char* key) {
  static const Json empty = Json::array();
  const auto it = json.find(key);
  return it != json.end() && it->is_array() ? *it : empty;
}
/// What another joint causes comes from the right one, where both say from which.
inline bool same_source(const Json& effect, const Json& subject) {
  const std::string from = text(effect, "from"), hidden = text(subject, "from");
  return from.empty() || hidden.empty() || from == hidden;
}

}  // namespace ravencal::prove
