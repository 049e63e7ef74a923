// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace ravencal::core {

/// write(2) until all is written; false: errno says why it is not. Waits for room. Any thread.
bool write_all(int file, std::string_view bytes) noexcept;

}  // namespace ravencal::core
