// SPDX-License-Identifier: Apache-2.0
//
// Decimal text to double, correctly rounded. Private to record/.
#pragma once

#include <fast_float/fast_float.h>

#include <optional>
#include <string_view>

namespace ravencal::record {

/// Parses a number at `first` and returns the first character behind it; nullptr if there is none.
inline const char* parse_number(const char* first, const char* last, double& value) {
  const auto result = fast_float::from_chars(first, last, value);
  return result.ec == std::errc() ? result.ptr : nullptr;
}

/// Text without the blanks, carriage returns and one pair of quotes around it.
std::string_view trimmed(std::string_view text);

/// A whole field as a number: blanks around it and a leading '+' are allowed; nan and inf are
/// numbers here.
std::optional<double> number_of(std::string_view field);

}  // namespace ravencal::record
