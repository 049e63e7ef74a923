// SPDX-License-Identifier: Apache-2.0
#include "exchange/table_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/median.hpp"

namespace ravencal::exchange {
namespace {

constexpr std::size_t kWordsShown = 4;
constexpr std::size_t kTextsLookedAt = 1000;

/// Median step of numbers that never fall; 0 if one does, or if there are no two.
template <typename T>
double median_step(const std::vector<T>& values) {
  if (values.size() < 2 || !std::is_sorted(values.begin(), values.end())) return 0.0;
  std::vector<T> steps(values.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = values[i + 1] - values[i];
  return static_cast<double>(core::upper_median(steps));
}

ColumnSummary summarise_column(const record::TableColumn& column) {
  ColumnSummary summary;
  summary.name = column.name;
  summary.rows = column.values.size();
  summary.min = std::numeric_limits<double>::infinity();
  summary.max = -summary.min;
  for (const double value : column.values) {
    if (std::isnan(value)) {
      ++summary.lost;
    } else {
      summary.min = std::min(summary.min, value);
      summary.max = std::max(summary.max, value);
    }
  }
  if (summary.lost == summary.rows)
    summary.min = summary.max = std::numeric_limits<double>::quiet_NaN();
  if (summary.lost == 0) summary.step = median_step(column.values);
  const std::size_t texts = std::min(column.texts.size(), kTextsLookedAt);
  for (std::size_t i = 0; i < texts && summary.words.size() < kWordsShown; ++i) {
    const std::string& text = column.texts[i];
    const bool known =
        std::find(summary.words.begin(), summary.words.end(), text) != summary.words.end();
    if (!known && !text.empty()) summary.words.push_back(text);
  }
  return summary;
}

double rate_hz(const record::Table& table) {
  const double step_ns = median_step(table.t_ns);
  return step_ns > 0.0 ? 1e9 / step_ns : 0.0;
}

}  // namespace

std::vector<ColumnSummary> summarise(const record::Table& table) {
  std::vector<ColumnSummary> summaries;
  for (const record::TableColumn& column : table.columns)
    summaries.push_back(summarise_column(column));
  return summaries;
}

std::string describe_in_words(const record::Table& table) {
  std::string text =
      fmt::format("{}: a table of {} columns{}; a profile says which of them is which channel\n",
                  table.path.string(), table.columns.size(),
                  table.has_header ? "" : " without names, which a profile gives by index");
  auto out = std::back_inserter(text);
  if (!table.t_ns.empty()) {
    fmt::format_to(
        out, "stamps of {} rows: {:.3f} s, {:.4g} Hz; a profile needs no time\n", table.t_ns.size(),
        1e-9 * static_cast<double>(table.t_ns.back() - table.t_ns.front()), rate_hz(table));
  }
  for (const ColumnSummary& c : summarise(table)) {
    fmt::format_to(out, "  {:<32} {:>8} rows, {:>12.6g} .. {:<12.6g}", c.name, c.rows, c.min,
                   c.max);
    if (c.step > 0.0)
      fmt::format_to(out, " rises by {:.6g} ({:.4g} Hz if it is in s)", c.step, 1.0 / c.step);
    if (!c.words.empty()) fmt::format_to(out, " words: {}", fmt::join(c.words, ", "));
    if (c.lost > 0) fmt::format_to(out, ", {} without a number", c.lost);
    text += "\n";
  }
  if (!table.note.empty()) text += table.note + "\n";
  for (const auto& [name, why] : table.left_out)
    fmt::format_to(out, "  {} is no column: {}\n", name, why);
  for (const record::Event& event : table.events)
    fmt::format_to(out, "left out: {}\n", event.detail);
  return text;
}

std::string describe_in_json(const record::Table& table) {
  using nlohmann::ordered_json;
  ordered_json columns = ordered_json::array();
  for (const ColumnSummary& c : summarise(table)) {
    columns.push_back({{"name", c.name},
                       {"rows", c.rows},
                       {"min", c.min},
                       {"max", c.max},
                       {"lost", c.lost},
                       {"step", c.step},
                       {"words", c.words}});
  }
  const ordered_json root = {
      {"kind", "table"},           {"file", table.path.string()}, {"header", table.has_header},
      {"rate_hz", rate_hz(table)}, {"columns", columns},          {"left_out", table.left_out}};
  return root.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace ravencal::exchange
