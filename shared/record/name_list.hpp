// SPDX-License-Identifier: Apache-2.0
//
// Names of channels as a value of meta keeps them: "truth.shoulder, truth.elbow".
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace ravencal::record {

inline bool is_listed(std::string_view list, std::string_view name) {
  return fmt::format(", {}, ", list).find(fmt::format(", {}, ", name)) != std::string::npos;
}

inline void add_to_list(std::string& list, std::string_view name) {
  if (!is_listed(list, name)) list += fmt::format("{}{}", list.empty() ? "" : ", ", name);
}

}  // namespace ravencal::record
