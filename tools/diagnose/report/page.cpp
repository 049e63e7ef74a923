// SPDX-License-Identifier: Apache-2.0
//
// The page of a diagnosis: what to know first, then the causes, then what to do, then the rest.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "diagnose/findings/verdict.hpp"
#include "diagnose/findings/words.hpp"
#include "diagnose/report/charts.hpp"
#include "diagnose/report/json_parts.hpp"
#include "diagnose/report/overview.hpp"
#include "diagnose/report/page_parts.hpp"
#include "diagnose/report/suggest.hpp"
#include "diagnose/report/write_report.hpp"
#include "report/escape.hpp"

namespace ravencal::diagnose {
namespace {

using report::Document;
using report::html_escape;

bool is_worse(const HeldOut& figure) { return figure.after > figure.before; }

std::string joints_html(const std::vector<JointLine>& lines) {
  std::string html = "<dl class=\"joints\">\n";
  for (const JointLine& line : lines) {
    const bool worse = line.figure != nullptr && is_worse(*line.figure);
    html += fmt::format("<dt>{}</dt><dd{}>{}</dd>\n", html_escape(line.joint),
                        worse ? " class=\"worse\"" : "", html_escape(line.sentence));
  }
  return html + "</dl>\n";
}

std::string tint_html(const char* css_class, double share, double rms, const std::string& unit) {
  return fmt::format("<span class=\"{}\" style=\"--share:{:.3f}\">{}</span>", css_class,
                     std::clamp(share, 0.0, 1.0), html_escape(quantity(rms, unit)));
}

std::string chain_cell_html(const ChainCell& cell) {
  std::string html;
  if (cell.figure == nullptr) {
    html = "<span class=\"none\">" + html_escape(cell.without_figure) + "</span>";
  } else {
    const HeldOut& f = *cell.figure;
    html = "<span class=\"tints\">" + tint_html("tint", cell.share_before, f.before, f.unit) +
           tint_html(is_worse(f) ? "tint worse" : "tint", cell.share_after, f.after, f.unit) +
           "</span>";
  }
  if (!cell.effects.empty()) {
    const std::string names = words_of(fmt::format("{}", fmt::join(cell.effects, ", ")));
    html += "<span class=\"found\">" + html_escape(names) + "</span>";
  }
  return html;
}

/// The chain of each joint, from the command to the sensor.
std::string chain_html(const Report& report) {
  std::string html = "<table class=\"chain\"><thead><tr><th></th>";
  for (const std::string_view stage : kChain) {
    html += fmt::format("<th scope=\"col\">{}{}</th>", stage,
                        stage == "joint" ? ", run free for 1 s" : "");
  }
  html += "</tr></thead><tbody>\n";
  const std::vector<ChainCell> cells = chain_of(report);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    if (c % kChain.size() == 0)
      html += fmt::format("<tr><th scope=\"row\">{}</th>", html_escape(cells[c].joint));
    html += "<td>" + chain_cell_html(cells[c]) + "</td>";
    if ((c + 1) % kChain.size() == 0) html += "</tr>\n";
  }
  return html +
         "</tbody></table>\n<p class=\"note\">RMSE on unseen motion, first of the plant as it is, "
         "then with what was found; colour: share of the squared error above the floor.</p>\n";
}

std::string held_out_html(const std::vector<JointLine>& lines, Document& page) {
  constexpr double kMost = 200.0;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<IntervalRow> rows;
  for (const JointLine& line : lines) {
    if (line.figure == nullptr || !std::isfinite(line.figure->change())) continue;
    const Interval ci = line.figure->change_ci95.value_or(Interval{kNone, kNone});
    rows.push_back({line.joint + ", " + metric_words(line.figure->metric),
                    100.0 * line.figure->change(), 100.0 * ci.first, 100.0 * ci.second,
                    percent(line.figure->change()), is_worse(*line.figure)});
  }
  if (rows.empty()) return "";
  return page.figure_html(
      interval_chart("change of the error on unseen motion", "change of the RMSE [%]", 0.0, kMost,
                     rows),
      "Error on motion that no fit saw",
      "95 % intervals over stretches of time. Red: the improved plant is worse.", false);
}

/// The channel that stands for the joint whose error was most above its floor.
const ChannelPlot* foremost(const Report& report, const std::vector<JointLine>& lines) {
  const ChannelPlot* best = nullptr;
  double most = -1.0;
  for (const ChannelPlot& plot : report.plots) {
    for (const JointLine& line : lines) {
      if (line.joint != plot.joint || line.figure == nullptr || plot.traces.empty()) continue;
      const bool shows = (plot.stage == "transmission") == (line.figure->metric == "position_rmse");
      const double excess = 1.0 - std::pow(line.figure->floor / line.figure->before, 2);
      if (!shows || !(excess > most)) continue;
      best = &plot;
      most = excess;
    }
  }
  return best;
}

std::string next_html(const Report& report) {
  std::string html = "<ol class=\"next\">\n";
  for (const Suggestion& s : suggestions_of(report_document(report))) {
    html += fmt::format("<li><b>{}</b> <span class=\"soft\">({:.1f} min)</span><br>{}</li>\n",
                        html_escape(s.experiment), s.minutes, html_escape(s.why));
  }
  return html + "</ol>\n";
}

std::string subtitle_of(const Report& report) {
  std::string text;
  for (const auto& [key, value] : report.provenance) {
    if (key == "recordings" || key == "held_out" || key == "plant")
      text += fmt::format("{}{}: {}", text.empty() ? "" : " · ",
                          key == "held_out" ? "held out" : key, value);
  }
  return text;
}

}  // namespace

void add_first_screen(const Report& report, Document& page) {
  const std::vector<JointLine> lines = joint_lines(report, causes_of(report));
  page.add(joints_html(lines) + chain_html(report));
  const std::string held_out = held_out_html(lines, page);
  const ChannelPlot* plot = foremost(report, lines);
  const std::string trace =
      plot == nullptr ? "" : trace_html(report, *plot, plot->traces.front(), page);
  if (!held_out.empty() || !trace.empty())
    page.add("<div class=\"wide-and-narrow\">" + trace + held_out + "</div>\n");
}

std::string report_html(const Report& report) {
  Document page;
  add_first_screen(report, page);
  add_causes(report, page);
  page.section("next", "What to record next");
  page.add(next_html(report));
  add_looked_at(report, page);
  add_details(report, page);
  page.provenance(report.provenance, "");
  return page.html({"Diagnosis of the simulation", subtitle_of(report), headline(report.verdict)});
}

}  // namespace ravencal::diagnose
