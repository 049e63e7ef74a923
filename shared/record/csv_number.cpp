// SPDX-License-Identifier: Apache-2.0
#include "record/csv_number.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace ravencal::record {
namespace {

constexpr std::string_view kBlanks = " \t";

/// Behind the quotes that begin at `at`; npos if they do not end.
std::size_t behind_quotes(std::string_view line, std::size_t at) {
  for (;;) {
    at = line.find('"', at + 1);
    if (at == std::string_view::npos) return at;
    if (line.substr(at + 1, 1) != "\"") return at + 1;
    ++at;
  }
}

}  // namespace

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

std::optional<std::string> with_point(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789";
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos || text.find('.') != std::string_view::npos) return {};
  if (text.find_first_of(kDigits, comma) != comma + 1) return {};
  std::string number(text);
  number[comma] = '.';
  if (!number_of(number)) return {};
  return number;
}

bool split_fields(std::string_view line, char delimiter, std::vector<std::string_view>& fields) {
  fields.clear();
  const bool runs = delimiter == ' ';
  const std::string_view blanks = delimiter == '\t' ? kBlanks.substr(0, 1) : kBlanks;
  const auto behind_blanks = [&](std::size_t at) {
    return std::min(line.find_first_not_of(blanks, at), line.size());
  };
  std::size_t begin = runs ? behind_blanks(0) : 0;
  for (;;) {
    const std::size_t first = behind_blanks(begin);
    const bool quoted = first < line.size() && line[first] == '"';
    const std::size_t from = quoted ? behind_quotes(line, first) : begin;
    if (from == std::string_view::npos) {
      fields.push_back(line.substr(begin));
      return false;
    }
    const std::size_t end = runs ? line.find_first_of(blanks, from) : line.find(delimiter, from);
    fields.push_back(line.substr(begin, end - begin));
    if (end == std::string_view::npos) return true;
    begin = runs ? behind_blanks(end) : end + 1;
    if (runs && begin == line.size()) return true;
  }
}

std::string open_quotes(std::size_t column) {
  return fmt::format("column {}: the quotes do not end on the line", column);
}

std::string text_of(std::string_view field) {
  const std::string_view inner = trimmed(field);
  std::string text(inner);
  const bool was_quoted = !inner.empty() && inner.data() > field.data() && inner.data()[-1] == '"';
  for (std::size_t at = text.find("\"\""); was_quoted && at != std::string::npos;
       at = text.find("\"\"", at + 1))
    text.erase(at, 1);
  return text;
}

}  // namespace ravencal::record
