// SPDX-License-Identifier: Apache-2.0
//
// A line's fields, and decimal text to double, correctly rounded. Private to record/.
#pragma once

#include <fast_float/fast_float.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

/// "1.5" for "1,5", where that makes a number; `text` is trimmed.
std::optional<std::string> with_point(std::string_view text);

/// Cuts a line at its delimiters, but not within quotes that begin a field; ' ' is any run of
/// blanks. Fields keep their blanks and quotes. False: the last field's quotes do not end.
bool split_fields(std::string_view line, char delimiter, std::vector<std::string_view>& fields);

/// The error of that field.
std::string open_quotes(std::size_t column);

/// What the field says: trimmed, with one quote for two where it was quoted.
std::string text_of(std::string_view field);

}  // namespace ravencal::record
