// SPDX-License-Identifier: Apache-2.0
#include "report/tables.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "report/escape.hpp"

namespace ravencal::report {
namespace {

constexpr const char* kDash = "–";

std::string cell(const std::string& text, const char* classes = "") {
  if (*classes == '\0') return fmt::format("<td>{}</td>", text);
  return fmt::format("<td class=\"{}\">{}</td>", classes, text);
}

std::string reduction_cell(double before, double after, bool first_of_group) {
  const bool worse = after > before;
  const std::string classes =
      fmt::format("{}{}", first_of_group ? "group " : "", worse ? "worse" : "strong");
  return cell(reduction_text(before, after), classes.c_str());
}

std::string figure_cells(const ErrorFigure& figure, int decimals, const char* first_classes) {
  return cell(figure_text(figure.rmse, decimals), first_classes) +
         cell(figure_text(figure.peak, decimals));
}

std::string error_row_html(const ErrorRow& row, bool with_published) {
  double least = kUnknown;
  for (const double rmse : {row.raw.rmse, row.bias_removed.rmse, row.calibrated.rmse}) {
    if (std::isfinite(rmse)) least = std::isfinite(least) ? std::min(least, rmse) : rmse;
  }
  const int decimals = decimals_for(least);
  std::string html = fmt::format("<tr><th scope=\"row\">{} [{}]</th>", html_escape(row.joint),
                                 html_escape(row.unit));
  html += cell(fmt::format("{}", row.samples));
  html += figure_cells(row.raw, decimals, "group");
  html += figure_cells(row.bias_removed, decimals, "group");
  html += figure_cells(row.calibrated, decimals, "group strong");
  html += reduction_cell(row.raw.rmse, row.calibrated.rmse, true);
  html += reduction_cell(row.raw.peak, row.calibrated.peak, false);
  html += reduction_cell(row.bias_removed.rmse, row.calibrated.rmse, true);
  html += reduction_cell(row.bias_removed.peak, row.calibrated.peak, false);
  if (with_published) {
    html += figure_cells(row.published.value_or(ErrorFigure{}), decimals, "group");
  }
  return html + "</tr>\n";
}

std::string note_html(const std::string& text) {
  return "<p class=\"note\">" + html_escape(text) + "</p>\n";
}

std::string microseconds(double duration_ns) {
  return std::isfinite(duration_ns) ? fmt::format("{:.2f}", duration_ns / core::kNsPerUs) : kDash;
}

std::string duration_row_html(const char* name, const DurationFigures& figures) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const double value : {figures.p50_ns, figures.p99_ns, figures.p999_ns, figures.max_ns}) {
    html += cell(microseconds(value));
  }
  return html + "</tr>\n";
}

}  // namespace

int decimals_for(double least) {
  if (!std::isfinite(least) || least <= 0) return 3;
  return std::clamp(2 - static_cast<int>(std::floor(std::log10(least))), 0, 6);
}

std::string figure_text(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : kDash;
}

std::string reduction_text(double before, double after) {
  if (!std::isfinite(before) || !std::isfinite(after) || before <= 0) return kDash;
  const double percent = 100 * (1 - after / before);
  return percent >= 0 ? fmt::format("{:.1f} %", percent) : fmt::format("−{:.1f} %", -percent);
}

std::string error_table_html(const ErrorTable& table) {
  const bool with_published =
      std::any_of(table.rows.begin(), table.rows.end(),
                  [](const ErrorRow& row) { return row.published.has_value(); });
  std::vector<std::string> groups = {"raw", "bias removed", "calibrated", "reduction from raw",
                                     "from bias removed"};
  if (with_published) groups.emplace_back("published");
  const std::string title = html_escape(table.title);
  std::string html = fmt::format(
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table>\n"
      "<caption>{0}</caption>\n<thead><tr><th rowspan=\"2\" scope=\"col\">joint</th>"
      "<th rowspan=\"2\" scope=\"col\">samples</th>",
      title);
  for (const std::string& group : groups) {
    html += fmt::format("<th colspan=\"2\" scope=\"colgroup\" class=\"group\">{}</th>", group);
  }
  html += "</tr>\n<tr>";
  for (std::size_t i = 0; i < groups.size(); ++i) {
    html += "<th scope=\"col\" class=\"group\">RMSE</th><th scope=\"col\">peak</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const ErrorRow& row : table.rows) html += error_row_html(row, with_published);
  html += "</tbody></table></div>\n";
  if (with_published && !table.published_label.empty()) {
    html += note_html("Published, calibrated: " + table.published_label + ".");
  }
  if (!table.note.empty()) html += note_html(table.note);
  return html;
}

std::string duration_table_html(const RealTimeFigures& figures) {
  return "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"durations\"><table>\n"
         "<thead><tr><th scope=\"col\">duration [µs]</th><th scope=\"col\">p50</th>"
         "<th scope=\"col\">p99</th><th scope=\"col\">p99.9</th><th "
         "scope=\"col\">max</th></tr></thead>\n<tbody>\n" +
         duration_row_html("wake-up lateness", figures.wakeup_ns) +
         duration_row_html("step", figures.step_ns) + "</tbody></table></div>\n";
}

std::string facts_html(const std::vector<std::pair<std::string, std::string>>& facts) {
  std::string html = "<table class=\"facts\"><tbody>\n";
  for (const auto& [name, value] : facts) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", html_escape(name),
                        html_escape(value));
  }
  return html + "</tbody></table>\n";
}

}  // namespace ravencal::report
