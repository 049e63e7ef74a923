// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

namespace ravencal::core {

/// Bytes of the character with which a text that is not empty begins, 1 to 4; 0 where it begins
/// with none of UTF-8 (RFC 3629): cut off, longer than it need be, a half of UTF-16's pairs.
std::size_t utf8_length(std::string_view text);

bool is_utf8(std::string_view text);

}  // namespace ravencal::core
