// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "record/csv_dialect.hpp"
#include "record/csv_number.hpp"

namespace ravencal::record {
namespace {

/// True for "1,234", which may be 1.234 or 1234.
bool may_be_thousands(std::string_view text) {
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t comma = text.find(',');
  const bool is_whole = text.find_first_not_of("0123456789,") == std::string_view::npos;
  return is_whole && text.size() == comma + 4 && comma >= 1 && comma <= 3 && text[0] != '0';
}

/// Rewrites a file line by line, with one decimal sign throughout.
class PlainForm {
 public:
  PlainForm(std::string_view text, char delimiter, const std::string& place)
      : text_(text), delimiter_(delimiter), place_(place) {}
  core::Result<std::string> write();

 private:
  struct Number {
    std::size_t line = 0;
    std::size_t column = 0;
    std::string text;
  };

  /// The next line into `fields_`; false behind the last one.
  bool next_line();
  /// The first number that has a decimal sign for certain.
  core::Status find_decimal_sign();
  core::Status append_line();
  core::Status append(std::size_t column, std::string_view field);
  [[nodiscard]] core::Error two_signs(const Number& other) const;

  std::string_view text_;
  char delimiter_;
  const std::string& place_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
  std::vector<std::string_view> fields_;  ///< none: the line is empty
  bool is_whole_ = true;                  ///< quotes end
  std::optional<Number> first_;           ///< with a decimal sign
  bool by_comma_ = false;
  std::string plain_;
};

bool PlainForm::next_line() {
  if (at_ > text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  std::string_view line = text_.substr(at_, end - at_);
  at_ = end + 1;
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (++line_ == 1) line = without_comment_sign(line);
  fields_.clear();
  is_whole_ = true;
  const std::string_view blanks = delimiter_ == '\t' ? " " : " \t";
  if (line.find_first_not_of(blanks) != std::string_view::npos)
    is_whole_ = split_fields(line, delimiter_, fields_);
  return true;
}

core::Status PlainForm::find_decimal_sign() {
  std::optional<Number> doubtful;
  // Between commas, a quoted "1,5" may be text: one decimal point in the file says that it is.
  const auto settled = [&] { return first_ && !(by_comma_ && delimiter_ == ','); };
  while (!settled() && next_line()) {
    for (std::size_t i = 0; i < fields_.size() && is_whole_ && !settled(); ++i) {
      const std::string_view text = trimmed(fields_[i]);
      const bool has_point = text.find('.') != std::string_view::npos && number_of(text);
      if (!has_point && !with_point(text)) continue;
      const bool says_nothing = !has_point && (first_ || may_be_thousands(text));
      if (says_nothing && doubtful) continue;
      (says_nothing ? doubtful : first_) = Number{line_, i + 1, std::string(text)};
      by_comma_ = first_ && !has_point;
    }
  }
  at_ = 0;
  line_ = 0;
  if (first_ || !doubtful || delimiter_ == ',') return {};
  return core::data_error(fmt::format(
      "{}:{}: column {}: '{}' may be {} or a number with a comma at its thousands, and no number "
      "of the file says which; write decimal points",
      place_, doubtful->line, doubtful->column, doubtful->text, *with_point(doubtful->text)));
}

core::Error PlainForm::two_signs(const Number& other) const {
  const auto sign_of = [](bool by_comma) { return by_comma ? "comma" : "point"; };
  return core::data_error(fmt::format(
      "{}:{}: column {}: '{}' has a decimal {}, and '{}' in line {}, column {} a decimal {}; write "
      "all numbers with one decimal sign",
      place_, other.line, other.column, other.text, sign_of(!by_comma_), first_->text, first_->line,
      first_->column, sign_of(by_comma_)));
}

core::Status PlainForm::append(std::size_t column, std::string_view field) {
  const std::string text = text_of(field);
  const bool has_point = text.find('.') != std::string::npos && number_of(text);
  const std::optional<std::string> number = with_point(text);
  const bool doubtful = delimiter_ == ',' || may_be_thousands(text);
  const bool contradicts = by_comma_ ? has_point : number && !doubtful;
  if (first_ && contradicts) return two_signs({line_, column, text});
  if (number && by_comma_) {
    plain_ += *number;
  } else if (text.find_first_of(",\"") == std::string::npos) {
    plain_ += text;
  } else {
    plain_ += '"';
    for (const char c : text) plain_.append(c == '"' ? 2 : 1, c);
    plain_ += '"';
  }
  return {};
}

core::Status PlainForm::append_line() {
  if (!is_whole_) {
    plain_.append(fields_.size() - 1, ',');
    plain_ += '"';  // a bad row, with the column
    return {};
  }
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    if (i > 0) plain_ += ',';
    RAVENCAL_RETURN_IF_ERROR(append(i + 1, fields_[i]));
  }
  return {};
}

core::Result<std::string> PlainForm::write() {
  RAVENCAL_RETURN_IF_ERROR(find_decimal_sign());
  plain_.reserve(text_.size() + text_.size() / 16);
  while (next_line()) {
    if (line_ > 1) plain_ += '\n';
    RAVENCAL_RETURN_IF_ERROR(append_line());
  }
  return std::move(plain_);
}

}  // namespace

core::Result<std::string> in_plain_form(std::string_view text, char delimiter,
                                        const std::string& place) {
  return PlainForm(text, delimiter, place).write();
}

}  // namespace ravencal::record
