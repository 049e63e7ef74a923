// SPDX-License-Identifier: Apache-2.0
//
// What was tried and what was chosen, in words.
#pragma once

#include <string>

#include "choice/choose.hpp"

namespace ravencal::choice {

/// Per joint: a line per candidate, best first, with RMSE, its 95 % interval and its weight in the
/// choice; then one sentence.
std::string choice_table(const Choice& choice);

}  // namespace ravencal::choice
