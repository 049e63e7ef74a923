// SPDX-License-Identifier: Apache-2.0
//
// What was looked at, and the details, folded.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "diagnose/findings/quantiles.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/report/charts.hpp"
#include "diagnose/report/overview.hpp"
#include "diagnose/report/page_parts.hpp"
#include "report/escape.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::diagnose {
namespace {

using report::Document;
using report::html_escape;

std::string folded(const std::string& title, const std::string& body) {
  if (body.empty()) return "";
  return "<details><summary>" + html_escape(title) + "</summary>\n" + body + "</details>\n";
}

std::string note(const std::string& text) { return report::paragraph_html("note", text); }

std::string range_text(const Interval& range, const std::string& unit) {
  return html_escape(
      fmt::format("{} to {}", quantity(range.first, unit), quantity(range.second, unit)));
}

// ------------------------------------------------------------------ what was looked at

/// Each recording apart, with the figures on those of its rows that no fit saw.
std::string recordings_html(const Report& report) {
  std::string rows;
  for (std::size_t r = 0; r < report.recordings.size(); ++r) {
    const SeenRecording& recording = report.recordings[r];
    std::string figures;
    for (const HeldOut& h : report.held_out) {
      for (const RecordingFigure& f : h.by_recording) {
        if (f.recording != r) continue;
        figures += fmt::format("{}{}, {}: {}", figures.empty() ? "" : "<br>", html_escape(h.joint),
                               metric_words(h.metric), change_html(f.before, f.after, h.unit));
      }
    }
    rows += row_html({html_escape(recording.name), recording.held_out ? "held out" : "fitted",
                      quantity(recording.duration_s, "s"), figures});
  }
  return table_html({"recording", "", "length", "error on unseen rows, before &rarr; after"}, rows);
}

std::string channels_seen_html(const Report& report) {
  std::string rows;
  for (const LookedAt& l : report.looked_at) {
    rows += row_html({html_escape(l.joint), l.stage, fmt::format("{}", l.rows),
                      fmt::format("{}", l.held_out_rows),
                      fmt::format("{:.3g} to {:.3g} Hz", l.band_hz.first, l.band_hz.second),
                      range_text(l.position, l.position_unit),
                      html_escape(quantity(l.fastest, l.position_unit) + "/s"),
                      fmt::format("{:.0f} %", 100.0 * l.rest_share),
                      l.load ? range_text(*l.load, l.effort_unit) : std::string("not known"),
                      html_escape(fmt::format("{}", fmt::join(l.circumstances, ", ")))});
  }
  return table_html({"joint", "stage", "rows", "held out", "band", "positions", "fastest",
                     "at rest", "load", "compared over"},
                    rows);
}

std::string not_seen_html(const Report& report) {
  std::string rows;
  for (const NotLookedAt& n : report.not_looked_at)
    rows += row_html({html_escape(n.joint), n.stage, html_escape(n.because)});
  return rows.empty() ? ""
                      : "<h3>What these recordings do not show</h3>" +
                            table_html({"joint", "stage", "because"}, rows);
}

// ------------------------------------------------------------------ details

std::string figures_html(const Report& report) {
  std::string rows;
  for (const HeldOut& h : report.held_out) {
    const std::string change =
        h.change_ci95 ? fmt::format("{} [{}, {}]", percent(h.change()),
                                    percent(h.change_ci95->first), percent(h.change_ci95->second))
                      : percent(h.change());
    rows += row_html(
        {html_escape(h.joint), metric_words(h.metric), html_escape(quantity(h.before, h.unit)),
         html_escape(quantity(h.after, h.unit)), html_escape(quantity(h.floor, h.unit)),
         h.after > h.before ? "<span class=\"worse\">" + change + "</span>" : change});
  }
  return table_html({"joint", "figure", "plant as it is", "improved", "floor", "change, 95 %"},
                    rows);
}

std::string left_html(const Report& report) {
  std::string rows;
  for (const ErrorLeft& e : report.left) {
    const bool measured = e.measured_by != "none";
    const std::string left = html_escape(quantity(e.left, e.unit));
    rows += row_html(
        {html_escape(e.joint), e.stage, html_escape(quantity(e.before, e.unit)),
         e.reached ? left : "<span class=\"worse\">" + left + "</span>",
         measured ? html_escape(quantity(e.floor, e.unit)) : "not known",
         e.measured_by == "repetition"
             ? fmt::format("repetition: {} rows that share {:.0f} % of their circumstances",
                           e.compared_rows, 100.0 * e.agreement)
             : e.measured_by,
         measured ? html_escape(quantity(e.allowed, e.unit)) : "",
         fmt::format("{:.3g} %", 100.0 * e.share())});
  }
  if (rows.empty()) return "";
  return note(
             "No effect has a part in this floor. Red: more is left than chance and the form of "
             "simulations allow.") +
         table_html({"joint", "stage", "plant as it is", "improved", "floor", "measured by",
                     "allowed", "share left above the floor"},
                    rows);
}

std::string mismatch_html(const Report& report) {
  constexpr std::size_t kMostTimes = 6;
  std::string rows;
  for (const Mismatch& m : report.mismatch) {
    std::string times;
    for (std::size_t i = 0; i < m.interval_s.size() && i < kMostTimes; ++i)
      times += fmt::format("{}{:.1f} to {:.1f} s", i > 0 ? "<br>" : "", m.interval_s[i].first,
                           m.interval_s[i].second);
    if (m.interval_s.size() > kMostTimes) times += "<br>and more in report.json";
    const bool prismatic = m.unit == "N" || m.unit == "m";
    std::string positions;
    for (const Interval& p : m.position) positions += range_text(p, prismatic ? "m" : "rad") + " ";
    rows += row_html({html_escape(m.joint), m.stage,
                      html_escape(fmt::format("{}", fmt::join(m.regime, "; "))), times, positions,
                      html_escape(quantity(m.excess_rmse, m.unit)),
                      html_escape(quantity(m.floor, m.unit)), chance_text(m.p_value)});
  }
  return table_html(
      {"joint", "stage", "circumstances", "times", "positions", "excess", "floor", "p"}, rows);
}

std::string together_html(const Report& report) {
  std::string rows;
  for (const Combination& c : report.combinations) {
    std::string product, alone;
    for (const CombinedParameter& p : c.parameters) {
      product += fmt::format("{}{} {}{}", product.empty() ? "" : " &times; ", html_escape(p.id),
                             html_escape(p.name),
                             p.power == 1.0 ? "" : fmt::format("<sup>{:g}</sup>", p.power));
      alone += fmt::format("{}{} by {:.0f} %", alone.empty() ? "" : ", ", html_escape(p.name),
                           100.0 * p.relative_deviation);
    }
    rows += row_html({html_escape(c.joint), c.stage, product, fmt::format("{:.3g}", c.value),
                      fmt::format("{:.3g} to {:.3g}", c.ci95.first, c.ci95.second), alone});
  }
  return table_html({"joint", "stage", "product", "value (SI)", "95 %", "alone uncertain"}, rows);
}

std::string candidates_html(const Report& report) {
  std::string rows;
  for (const CandidateRow& c : report.candidates) {
    rows += row_html({html_escape(c.joint), c.stage, html_escape(c.id),
                      fmt::format("{:.2f} %", 100.0 * c.gain_share), fmt::format("{:.1f}", c.z),
                      fmt::format("{:.4f}", c.p_value), html_escape(quantity(c.size, c.unit)),
                      html_escape(c.outcome)});
  }
  return table_html({"joint", "stage", "effect", "gain", "z", "p", "size", "outcome"}, rows);
}

std::string limits_html(const Report& report) {
  std::string rows;
  for (const NotFound& n : report.not_found) {
    if (!n.detection_limit) continue;
    rows += row_html({html_escape(n.joint), html_escape(n.id),
                      html_escape(quantity(*n.detection_limit, n.unit)), html_escape(n.parameter)});
  }
  return table_html({"joint", "effect", "would have been found from", "of"}, rows);
}

std::string untestable_html(const Report& report) {
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> ids;
  for (const NotFound& n : report.not_found) {
    if (!n.detection_limit) ids[{n.joint, n.not_testable_because}].push_back(n.id);
  }
  std::string rows;
  for (const auto& [key, list] : ids) {
    rows += row_html({html_escape(key.first), html_escape(fmt::format("{}", fmt::join(list, ", "))),
                      html_escape(key.second)});
  }
  return table_html({"joint", "effects", "because"}, rows);
}

std::string sizes_html(const ChannelPlot& plot, Document& page) {
  constexpr double kMost = 3.0;
  std::string html;
  for (std::size_t first = 0; first < plot.scales.size();) {
    const std::string& effect = plot.scales[first].effect;
    std::vector<IntervalRow> rows;
    for (; first < plot.scales.size() && plot.scales[first].effect == effect; ++first) {
      const RegimeScale& s = plot.scales[first];
      rows.push_back({s.regime, s.scale, s.scale - kNormal95 * s.error,
                      s.scale + kNormal95 * s.error, fmt::format("{:.2f}", s.scale), false});
    }
    html += page.figure_html(interval_chart(effect + ": size by circumstance",
                                            "of its size on all data", 1.0, kMost, rows),
                             "Size of " + effect + " by circumstance", "", false);
  }
  return html;
}

std::string channel_html(const Report& report, const ChannelPlot& plot, Document& page) {
  std::string html;
  const auto add = [&](const nlohmann::json& spec, const std::string& heading,
                       const std::string& caption) {
    if (!spec.is_null()) html += page.figure_html(spec, heading, caption, false);
  };
  for (const Trace& trace : plot.traces) html += trace_html(report, plot, trace, page);
  const bool fitted = !plot.traces.empty() && plot.traces.front().fitted;
  if (plot.waterfall.size() > 1)
    add(waterfall_chart(plot),
        fitted ? "Error as the model grows" : "Error on unseen rows as the model grows", "");
  add(where_chart(plot), "Error over position and speed", "Hatched: too little data.");
  add(residual_chart(plot, Abscissa::kPosition), "Error over position", "");
  add(residual_chart(plot, Abscissa::kSpeed), "Error over speed", "");
  add(residual_chart(plot, Abscissa::kLoad), "Error over effort", "");
  add(rest_chart(plot), "Error at rest", "");
  html += sizes_html(plot, page);
  return html.empty() ? "" : "<div class=\"charts\">" + html + "</div>";
}

}  // namespace

std::string row_html(const std::vector<std::string>& cells, bool header) {
  std::string html = "<tr>";
  for (const std::string& cell : cells) {
    html += header ? "<th scope=\"col\">" + cell + "</th>" : "<td>" + cell + "</td>";
  }
  return html + "</tr>\n";
}

std::string table_html(const std::vector<std::string>& header, const std::string& rows) {
  if (rows.empty()) return "";
  return "<table class=\"words\"><thead>" + row_html(header, true) + "</thead><tbody>\n" + rows +
         "</tbody></table>\n";
}

std::string chance_text(double p_value) {
  return std::isfinite(p_value) ? fmt::format("{:.4f}", p_value) : std::string("not known");
}

std::string change_html(double before, double after, const std::string& unit) {
  const std::string text =
      html_escape(quantity(before, unit)) + " &rarr; " + html_escape(quantity(after, unit));
  return after > before ? "<span class=\"worse\">" + text + "</span>" : text;
}

std::string trace_html(const Report& report, const ChannelPlot& plot, const Trace& trace,
                       Document& page) {
  const std::string recording = trace.recording < report.recordings.size()
                                    ? " in " + report.recordings[trace.recording].name
                                    : std::string();
  const std::string key =
      "<ul class=\"key\">" + report::key_item_html(report::kTruthColour, "none", 4, "recorded") +
      report::key_item_html(report::kRawColour, "4 2", 2, "simulated before") +
      report::key_item_html(report::kCorrectedColour, "none", 2, "simulated after") + "</ul>";
  const char* rows = trace.cross_validated ? "Each row under a fit that did not see it."
                     : trace.fitted        ? "Rows that were fitted: none were held out."
                                           : "Held-out rows.";
  return "<div>" +
         page.figure_html(trace_chart(plot, trace), fmt::format("{}{}", place_of(plot), recording),
                          fmt::format("{} Error = simulated − recorded.", rows), false) +
         key + "</div>";
}

void add_looked_at(const Report& report, Document& page) {
  page.section("looked-at", "What was looked at");
  page.add(recordings_html(report) + channels_seen_html(report) + not_seen_html(report));
}

void add_details(const Report& report, Document& page) {
  page.section("details", "Details");
  page.add(folded("The verdict in full", "<p>" + html_escape(report.verdict.text) + "</p>"));
  page.add(folded("Every figure on unseen motion", figures_html(report)));
  page.add(folded("What is left of the error", left_html(report)));
  page.add(folded("Where the plant and the recordings part", mismatch_html(report)));
  for (const ChannelPlot& plot : report.plots)
    page.add(folded(place_of(plot), channel_html(report, plot, page)));
  page.add(folded("Known only together", together_html(report)));
  page.add(folded("Candidates and their gates", candidates_html(report)));
  page.add(folded("Not found, and from which size it would have been", limits_html(report)));
  page.add(folded("Not testable with these recordings", untestable_html(report)));
}

}  // namespace ravencal::diagnose
