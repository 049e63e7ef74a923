// SPDX-License-Identifier: Apache-2.0
//
// Text of other encodings as UTF-8. Private to record/.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::record {

struct CsvEncoding {
  enum class Form { kBytes, kUtf16Little, kUtf16Big, kUtf32 };
  Form form = Form::kBytes;  ///< kBytes: UTF-8 or one of one byte a character
  std::size_t mark = 0;      ///< bytes of the byte order mark
};

/// By the byte order mark, or by the zeros that ASCII characters have in UTF-16.
CsvEncoding encoding_of(std::string_view first_bytes);

/// UTF-16 without its mark. Errors (kData) name the byte, counted from `text`.
core::Result<std::string> utf8_of_utf16(std::string_view text, bool big_endian);

/// Text that is no UTF-8 as Latin-1, so that a name is one that a profile can hold.
std::string utf8_of_bytes(std::string text);

}  // namespace ravencal::record
