// SPDX-License-Identifier: Apache-2.0
#include "record/csv_encoding.hpp"

#include <fmt/format.h>

#include <cstdint>

#include "core/utf8.hpp"

namespace ravencal::record {
namespace {

void append_utf8(std::string& text, std::uint32_t code) {
  if (code < 0x80U) {
    text += static_cast<char>(code);
    return;
  }
  const unsigned more = code < 0x800U ? 1 : code < 0x10000U ? 2 : 3;
  constexpr std::uint32_t kLead[] = {0, 0xc0, 0xe0, 0xf0};
  text += static_cast<char>(kLead[more] | (code >> (6U * more)));
  for (unsigned i = more; i-- > 0;) text += static_cast<char>(0x80U | ((code >> (6U * i)) & 0x3fU));
}

}  // namespace

CsvEncoding encoding_of(std::string_view first_bytes) {
  using Form = CsvEncoding::Form;
  using namespace std::string_view_literals;
  if (first_bytes.starts_with("\xEF\xBB\xBF"sv)) return {Form::kBytes, 3};
  if (first_bytes.starts_with("\xFF\xFE\0\0"sv) || first_bytes.starts_with("\0\0\xFE\xFF"sv))
    return {Form::kUtf32, 4};
  if (first_bytes.starts_with("\xFF\xFE"sv)) return {Form::kUtf16Little, 2};
  if (first_bytes.starts_with("\xFE\xFF"sv)) return {Form::kUtf16Big, 2};
  if (first_bytes.size() < 4) return {};
  const auto is_zero = [&](std::size_t at) { return first_bytes[at] == '\0'; };
  if (is_zero(0) != is_zero(1) && is_zero(0) == is_zero(2) && is_zero(1) == is_zero(3))
    return {is_zero(0) ? Form::kUtf16Big : Form::kUtf16Little, 0};
  return {};
}

core::Result<std::string> utf8_of_utf16(std::string_view text, bool big_endian) {
  const auto unit_at = [&](std::size_t at) {
    const auto first = static_cast<std::uint8_t>(text[at]);
    const auto second = static_cast<std::uint8_t>(text[at + 1]);
    return static_cast<std::uint32_t>(big_endian ? first << 8U | second : second << 8U | first);
  };
  const auto is_half = [](std::uint32_t unit, std::uint32_t which) {
    return (unit & 0xfc00U) == which;
  };
  std::string result;
  result.reserve(text.size() / 2);
  for (std::size_t at = 0; at < text.size(); at += 2) {
    const bool whole = at + 2 <= text.size();
    std::uint32_t code = whole ? unit_at(at) : 0xdc00U;
    if (is_half(code, 0xd800U) && at + 4 <= text.size() && is_half(unit_at(at + 2), 0xdc00U)) {
      at += 2;
      code = 0x10000U + ((code & 0x3ffU) << 10U) + (unit_at(at) & 0x3ffU);
    } else if (is_half(code, 0xd800U) || is_half(code, 0xdc00U)) {
      return core::data_error(
          fmt::format("byte {} is half a character of UTF-16; save the file as UTF-8", at));
    }
    append_utf8(result, code);
  }
  return result;
}

std::string utf8_of_bytes(std::string text) {
  if (core::is_utf8(text)) return text;
  std::string result;
  for (const char c : text) append_utf8(result, static_cast<std::uint8_t>(c));
  return result;
}

}  // namespace ravencal::record
