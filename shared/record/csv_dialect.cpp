// SPDX-License-Identifier: Apache-2.0
#include "record/csv_dialect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "record/csv_number.hpp"

namespace ravencal::record {
namespace {

using Fields = std::vector<std::string_view>;

// In the order in which they are preferred where several read a file equally well.
constexpr std::array kDelimiters = {',', ';', '\t', ' '};

std::string words_for(char delimiter) {
  if (delimiter == '\t') return "tabs";
  return delimiter == ' ' ? "blanks" : fmt::format("'{}'", delimiter);
}

bool is_value(std::string_view field) {
  const std::string_view text = trimmed(field);
  return text.empty() || number_of(text) || with_point(text);
}

/// Of `fields`, 0 to 1.
double share_of_values(const Fields& fields) {
  return static_cast<double>(std::count_if(fields.begin(), fields.end(), is_value)) /
         static_cast<double>(fields.size());
}

struct Line {
  std::size_t number = 0;  ///< in the file, from 1
  std::string_view text;
};

std::vector<Line> lines_of(std::string_view beginning) {
  std::vector<Line> lines;
  for (std::size_t number = 1; lines.size() <= kDialectLines; ++number) {
    const std::size_t end = beginning.find('\n');
    std::string_view text = beginning.substr(0, end);
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (number == 1) text = without_comment_sign(text);
    if (number == 1 || !trimmed(text).empty()) lines.push_back({number, text});
    if (end == std::string_view::npos) break;
    beginning.remove_prefix(end + 1);
  }
  return lines;
}

/// What a delimiter makes of the first lines.
struct Fit {
  char delimiter = ',';
  std::size_t columns = 0;  ///< of the first line
  bool has_header = false;  ///< the first line has words
  bool fits_all = true;     ///< every row has as many columns
  double values = 0.0;      ///< share of fields that are numbers, in rows of as many columns
};

Fit fit_of(char delimiter, const std::vector<Line>& lines) {
  Fields fields;
  Fit fit;
  fit.delimiter = delimiter;
  fit.fits_all = split_fields(lines.front().text, delimiter, fields);
  fit.columns = fields.size();
  fit.has_header = share_of_values(fields) < 1.0;
  const std::size_t first_row = lines.size() > 1 ? 1 : 0;
  for (std::size_t i = first_row; i < lines.size(); ++i) {
    const bool fits =
        split_fields(lines[i].text, delimiter, fields) && fields.size() == fit.columns;
    if (fits) fit.values += share_of_values(fields);
    fit.fits_all = fit.fits_all && fits;
  }
  fit.values /= static_cast<double>(lines.size() - first_row);
  if (fit.columns < 2 && delimiter != ',') fit.values = 0.0;  // it separates nothing
  return fit;
}

/// Blanks are common within the names of files with another separator.
bool names_hold_separators(std::string_view first_line) {
  Fields fields;
  (void)split_fields(first_line, ' ', fields);
  return std::any_of(fields.begin(), fields.end(), [](std::string_view field) {
    return !field.starts_with('"') && field.find_first_of(",;") != std::string_view::npos;
  });
}

/// Rows of numbers under a first line that has another number of columns.
core::Status check_that_something_fits(const Fit& best, const std::vector<Line>& lines,
                                       const std::string& place) {
  if (best.values > 0.0 || lines.size() < 2) return {};
  Fields fields;
  for (const char delimiter : kDelimiters) {
    const Line& row = lines[1];
    if (!split_fields(row.text, delimiter, fields) || fields.size() < 2) continue;
    const std::size_t columns = fields.size();
    if (share_of_values(fields) < 1.0) continue;
    (void)split_fields(lines.front().text, delimiter, fields);
    const bool may_be_decimal_commas = lines.size() > 2 && columns >= 2 * fields.size() - 1;
    if (best.columns > 1 && !may_be_decimal_commas) continue;  // a bad row like any other
    return core::data_error(fmt::format(
        "{}:{}: {} numbers separated by {}, where line 1 has {} so separated ('{}'); line 1 must "
        "name every column, with the rows' separator, and where decimal signs are commas the "
        "separator must be another, such as ';'",
        place, row.number, columns, words_for(delimiter), fields.size(),
        lines.front().text.substr(0, 40)));
  }
  return {};
}

/// Names may hold another delimiter as often as numbers hold decimal commas.
core::Status check_that_one_fits(const Fit& best, const Fit& other, const std::string& place) {
  constexpr double kEnoughValues = 0.5;  // of the fields; with fewer it is no table of numbers
  if (!best.has_header || other.delimiter == best.delimiter || other.delimiter == ' ') return {};
  if (other.columns < 2 || !other.fits_all || other.values < kEnoughValues) return {};
  return core::data_error(fmt::format(
      "{}:1: can be read as {} columns separated by {} or as {} separated by {}; put names that "
      "hold a separator in quotes",
      place, best.columns, words_for(best.delimiter), other.columns, words_for(other.delimiter)));
}

}  // namespace

std::string_view without_comment_sign(std::string_view first_line) {
  if (first_line.starts_with("# ")) first_line.remove_prefix(2);
  return first_line;
}

core::Result<CsvDialect> find_dialect(std::string_view beginning, const std::string& place) {
  const std::vector<Line> lines = lines_of(beginning);
  const bool has_quotes = std::any_of(lines.begin() + 1, lines.end(), [](const Line& line) {
    return line.text.find('"') != std::string_view::npos;
  });
  std::vector<Fit> fits;
  for (const char delimiter : kDelimiters) {
    const Fit& fit = fits.emplace_back(fit_of(delimiter, lines));
    if (fits.size() == 1 && fit.columns > 1 && fit.fits_all && fit.values == 1.0)
      return CsvDialect{',', !has_quotes};
    if (delimiter == ' ' && fit.has_header && names_hold_separators(lines.front().text))
      fits.pop_back();
  }
  const Fit& best = *std::max_element(
      fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.values < b.values; });
  RAVENCAL_RETURN_IF_ERROR(check_that_something_fits(best, lines, place));
  for (const Fit& other : fits) {
    if (best.delimiter != ',') RAVENCAL_RETURN_IF_ERROR(check_that_one_fits(best, other, place));
  }
  return CsvDialect{best.delimiter, best.delimiter == ',' && !has_quotes};
}

}  // namespace ravencal::record
