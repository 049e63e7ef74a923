// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace ravencal::core {

/// Stops where only a mistake of the program can have led, in every build: programs exit with 3 and
/// say the sentence. What a user can cause is a Result. Not for real-time code.
inline void require(bool holds, const char* sentence) {
  if (!holds) throw std::logic_error(sentence);
}

}  // namespace ravencal::core
