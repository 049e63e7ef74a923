// SPDX-License-Identifier: Apache-2.0
//
// Names as the report writes them in sentences and lists.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace ravencal::diagnose {

/// An id in words: "gain_error" as "gain error".
inline std::string words_of(std::string id) {
  std::replace(id.begin(), id.end(), '_', ' ');
  return id;
}

/// Appends `item` to a list that lacks it.
inline void add_once(std::vector<std::string>& list, const std::string& item) {
  if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
}

}  // namespace ravencal::diagnose
