// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "choice/rows.hpp"

namespace ravencal::choice {

/// Of sessions, speeds and loads, those of which the training has one; a sentence, or none. What
/// does not vary in the training is neither learned nor in the expected error.
std::vector<std::string> variety_warnings(const Rows& rows);

}  // namespace ravencal::choice
