// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>

#include "ravencal/plugin.h"

namespace ravencal::rt {

/// Why a load was refused: a RAVENCAL_ERROR_* and a sentence.
struct LoadFailure {
  std::int32_t code = RAVENCAL_SUCCESS;
  std::array<char, 256> message{};

  template <typename... Arguments>
  void say(std::int32_t reason, const char* format, Arguments... arguments) noexcept {
    code = reason;
    (void)std::snprintf(message.data(), message.size(), format, arguments...);
  }
};

}  // namespace ravencal::rt
