// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "choice/rows.hpp"

namespace ravencal::choice {

/// Of homings, speeds and loads, those of which the training has one; a sentence, or none. What
/// does not vary in the training is neither learned nor in the expected error. `homings`: how many
/// the constants of the sessions show.
std::vector<std::string> variety_warnings(const Rows& rows, std::size_t homings);

}  // namespace ravencal::choice
