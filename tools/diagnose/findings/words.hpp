// SPDX-License-Identifier: Apache-2.0
//
// Names as the report writes them in sentences and lists.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/words_of.hpp"

namespace ravencal::diagnose {

using core::words_of;

/// Appends `item` to a list that lacks it.
inline void add_once(std::vector<std::string>& list, const std::string& item) {
  if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
}

}  // namespace ravencal::diagnose
