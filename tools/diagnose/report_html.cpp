// SPDX-License-Identifier: Apache-2.0
//
// The page: verdict, where, effects with their gates, residuals before and after, candidates,
// detection limits. Drawings are SVG made here, so that the page opens anywhere without scripts.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "diagnose/diagnose.hpp"
#include "diagnose/verdict.hpp"
#include "report/escape.hpp"

namespace ravencal::diagnose {
namespace {

using report::html_escape;

constexpr double kWidth = 440.0;
constexpr double kHeight = 200.0;
constexpr double kMargin = 46.0;

constexpr std::string_view kStyle = R"(<style>
:root{--ink:#1c2430;--soft:#5b6675;--line:#d9dee5;--a:#0072b2;--b:#d55e00;--ok:#009e73;--bg:#fff}
@media(prefers-color-scheme:dark){:root{--ink:#e8ecf1;--soft:#9aa6b5;--line:#38424f;--a:#56b4e9;--b:#e69f00;--ok:#2cc295;--bg:#14191f}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--bg);max-width:980px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}table{border-collapse:collapse;width:100%;font-size:.9rem}
th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid var(--line);vertical-align:top}th{color:var(--soft);font-weight:600}
.verdict{border-left:4px solid var(--a);padding:.5rem 1rem}.soft{color:var(--soft)}.figures{display:flex;flex-wrap:wrap;gap:1rem}
svg{background:transparent}svg text{fill:var(--soft);font-size:11px}.axis{stroke:var(--line)}.n{fill:var(--a)}.p{fill:var(--b)}
</style>)";

struct Range {
  double from = 0.0;
  double to = 1.0;
};

Range range_of(const std::vector<double>& a, const std::vector<double>& b = {}) {
  Range r{1e300, -1e300};
  for (const auto* list : {&a, &b}) {
    for (const double v : *list) {
      r.from = std::min(r.from, v);
      r.to = std::max(r.to, v);
    }
  }
  if (!(r.to > r.from)) return {r.from - 0.5, r.from + 0.5};
  return r;
}

double display_factor(const std::string& unit) {
  if (unit == "rad") return 180.0 / 3.14159265358979323846;
  return unit == "m" ? 1e3 : 1.0;
}

std::string display_unit(const std::string& unit) {
  if (unit == "rad") return "deg";
  return unit == "m" ? "mm" : unit;
}

struct Axes {
  Range x, y;
  std::string x_title, y_title;
  double x_factor = 1.0, y_factor = 1.0;
};

/// Dots coloured by direction of motion: blue down, orange up.
std::string scatter(const std::vector<double>& x, const std::vector<double>& y,
                    const std::vector<double>& direction, const Axes& axes,
                    const std::string& title) {
  std::string svg = fmt::format(
      "<svg role=\"img\" aria-label=\"{0}\" viewBox=\"0 0 {1} {2}\" width=\"{1}\" "
      "height=\"{2}\"><title>{0}</title>",
      html_escape(title), kWidth, kHeight);
  const double w = kWidth - kMargin - 8.0;
  const double h = kHeight - 2.0 * 24.0;
  const auto px = [&](double v) {
    return kMargin + w * (v - axes.x.from) / (axes.x.to - axes.x.from);
  };
  const auto py = [&](double v) {
    return 24.0 + h * (1.0 - (v - axes.y.from) / (axes.y.to - axes.y.from));
  };
  svg += fmt::format(
      "<line class=\"axis\" x1=\"{0}\" y1=\"24\" x2=\"{0}\" y2=\"{1}\"/><line class=\"axis\" "
      "x1=\"{0}\" y1=\"{1}\" x2=\"{2}\" y2=\"{1}\"/>",
      kMargin, 24.0 + h, kMargin + w);
  for (std::size_t i = 0; i < x.size(); ++i) {
    svg += fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1.3\"/>",
                       direction[i] < 0.0 ? 'n' : 'p', px(x[i]), py(y[i]));
  }
  svg += fmt::format("<text x=\"4\" y=\"14\">{}</text>", html_escape(title + ", " + axes.y_title));
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", kWidth - 8,
                     kHeight - 4, html_escape(axes.x_title));
  svg += fmt::format("<text x=\"2\" y=\"34\">{:.3g}</text><text x=\"2\" y=\"{}\">{:.3g}</text>",
                     axes.y.to * axes.y_factor, 24.0 + h, axes.y.from * axes.y_factor);
  svg += fmt::format(
      "<text x=\"{}\" y=\"{}\">{:.3g}</text><text x=\"{}\" y=\"{}\" "
      "text-anchor=\"end\">{:.3g}</text></svg>",
      kMargin, kHeight - 12, axes.x.from * axes.x_factor, kMargin + w, kHeight - 14,
      axes.x.to * axes.x_factor);
  return svg;
}

std::string plots_html(const Report& report) {
  std::string html;
  for (const ChannelPlot& p : report.plots) {
    const Range y = range_of(p.before, p.after);
    const double factor = display_factor(p.unit);
    const std::string unit = display_unit(p.unit);
    const Axes time{range_of(p.t_s), y, "time, s", unit, 1.0, factor};
    const Axes place{range_of(p.position),
                     y,
                     "position, " + display_unit(p.position_unit),
                     unit,
                     display_factor(p.position_unit),
                     factor};
    html += fmt::format("<h3>{}, {}</h3><div class=\"figures\">{}{}{}{}</div>",
                        html_escape(p.joint), html_escape(p.stage),
                        scatter(p.position, p.before, p.direction, place, "before"),
                        scatter(p.position, p.after, p.direction, place, "after"),
                        scatter(p.t_s, p.before, p.direction, time, "before"),
                        scatter(p.t_s, p.after, p.direction, time, "after"));
  }
  return html.empty() ? ""
                      : "<h2>What the plant does not predict, before and after</h2><p "
                        "class=\"soft\">Blue: negative direction of motion, orange: positive.</p>" +
                            html;
}

std::string effects_html(const Report& report) {
  if (report.effects.empty()) return "";
  std::string rows;
  for (const NamedEffect& e : report.effects) {
    std::string parameters;
    for (const NamedParameter& p : e.parameters) {
      if (p.name.starts_with("begin_")) continue;
      parameters +=
          fmt::format("{} = {} [{}, {}]<br>", html_escape(p.name), quantity(p.value, p.unit),
                      quantity(p.ci95.first, p.unit), quantity(p.ci95.second, p.unit));
    }
    std::string look_alikes =
        e.ambiguous_with.empty()
            ? ""
            : fmt::format("{}<br><span class=\"soft\">{}</span>", fmt::join(e.ambiguous_with, ", "),
                          html_escape(e.separate_by));
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td><b>{}</b>{}</td><td>{}</td><td>{} &rarr; "
        "{}</td><td>{:.4f}</td><td>{:.0f} %</td><td>{}</td></tr>",
        html_escape(e.joint), e.stage, html_escape(e.id),
        e.out_of_tolerance ? " (out of tolerance)" : "", parameters,
        quantity(e.held_out_before, e.unit), quantity(e.held_out_after, e.unit), e.p_value,
        100.0 * e.invariance_spread, look_alikes);
  }
  return "<h2>Effects</h2><table><tr><th>joint</th><th>stage</th><th>effect</th><th>parameters, 95 "
         "%</th><th>held-out error without &rarr; with</th>"
         "<th>p</th><th>spread over regimes</th><th>not told apart from</th></tr>" +
         rows + "</table>";
}

std::string where_html(const Report& report) {
  if (report.mismatch.empty()) return "";
  std::string rows;
  for (const Mismatch& m : report.mismatch) {
    std::string intervals;
    for (std::size_t i = 0; i < m.interval_s.size() && i < 6; ++i)
      intervals +=
          fmt::format("{:.1f}&ndash;{:.1f} s ", m.interval_s[i].first, m.interval_s[i].second);
    if (m.interval_s.size() > 6) intervals += fmt::format("and {} more", m.interval_s.size() - 6);
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.4f}</td></"
        "tr>",
        html_escape(m.joint), m.stage, html_escape(fmt::format("{}", fmt::join(m.regime, "; "))),
        intervals, quantity(m.excess_rmse, m.unit), quantity(m.floor, m.unit), m.p_value);
  }
  return "<h2>Where</h2><table><tr><th>joint</th><th>stage</th><th>circumstances</th><th>times</"
         "th><th>excess</th><th>floor</th><th>p</th></tr>" +
         rows + "</table>";
}

std::string held_out_html(const Report& report) {
  std::string rows;
  for (const HeldOut& h : report.held_out) {
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                        html_escape(h.joint), h.metric, quantity(h.before, h.unit),
                        quantity(h.after, h.unit), quantity(h.floor, h.unit));
  }
  return rows.empty()
             ? ""
             : "<h2>On data that no fit saw</h2><table><tr><th>joint</th><th>metric</th><th>plant "
               "as it is</th><th>with the effects</th><th>floor</th></tr>" +
                   rows + "</table>";
}

std::string candidates_html(const Report& report) {
  std::string rows;
  for (const CandidateRow& c : report.candidates) {
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.2f} "
        "%</td><td>{:.1f}</td><td>{:.4f}</td><td>{}</td><td>{}</td></tr>",
        html_escape(c.joint), c.stage, html_escape(c.id), 100.0 * c.gain_share, c.z, c.p_value,
        quantity(c.size, c.unit), c.outcome);
  }
  return rows.empty()
             ? ""
             : "<h2>Candidates that were not "
               "named</h2><table><tr><th>joint</th><th>stage</th><th>effect</th><th>held-out "
               "gain</th><th>z</th><th>p</th><th>size</th><th>why not</th></tr>" +
                   rows + "</table>";
}

std::string not_found_html(const Report& report) {
  std::string rows;
  for (const NotFound& n : report.not_found) {
    rows +=
        n.detection_limit
            ? fmt::format("<tr><td>{}</td><td>{}</td><td>would have been seen from {}</td></tr>",
                          html_escape(n.joint), n.id, quantity(*n.detection_limit, n.unit))
            : fmt::format("<tr class=\"soft\"><td>{}</td><td>{}</td><td>not testable: {}</td></tr>",
                          html_escape(n.joint), n.id, html_escape(n.not_testable_because));
  }
  return "<h2>Not found</h2><table><tr><th>joint</th><th>effect</th><th>detection limit</th></tr>" +
         rows + "</table>";
}

}  // namespace

std::string report_html(const Report& report) {
  const std::string rate = report.verdict.false_alarm_rate
                               ? ""
                               : "<p class=\"soft\">No placebo twins were run (--placebo N), so "
                                 "the false-alarm rate of this recording was not measured.</p>";
  return fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">"
      "<title>ravencal diagnose: {0}</title>{1}</head><body><h1>{0}</h1><p "
      "class=\"verdict\">{2}</p>{3}{4}{5}{6}{7}{8}{9}</body></html>\n",
      html_escape(report.verdict.kind), kStyle, html_escape(report.verdict.text), rate,
      where_html(report), effects_html(report), held_out_html(report), plots_html(report),
      candidates_html(report), not_found_html(report));
}

}  // namespace ravencal::diagnose
