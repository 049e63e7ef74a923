// SPDX-License-Identifier: Apache-2.0
#include "record/csv_number.hpp"

namespace ravencal::record {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  text = text.substr(first, text.find_last_not_of(kBlank) - first + 1);
  const bool quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return quoted ? text.substr(1, text.size() - 2) : text;
}

std::optional<double> number_of(std::string_view field) {
  field = trimmed(field);
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0.0;
  const char* const last = field.data() + field.size();
  if (field.empty() || parse_number(field.data(), last, value) != last) return std::nullopt;
  return value;
}

}  // namespace ravencal::record
