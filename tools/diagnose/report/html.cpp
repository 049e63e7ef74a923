// SPDX-License-Identifier: Apache-2.0
//
// The page: verdict, effects with every gate, where, figures of each channel, what would have been
// seen. One file that opens anywhere, offline and without scripts.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnose/findings/verdict.hpp"
#include "diagnose/report/figures.hpp"
#include "diagnose/report/suggest.hpp"
#include "diagnose/report/svg.hpp"
#include "diagnose/report/write_report.hpp"
#include "report/escape.hpp"

namespace ravencal::diagnose {
namespace {

using report::html_escape;

constexpr std::string_view kStyle = R"(<style>
:root{--ink:#1c2430;--soft:#5b6675;--line:#d9dee5;--a:#0072b2;--b:#d55e00;--ok:#009e73;--bg:#fff;--card:#f5f7fa;--bad:#b3261e}
@media(prefers-color-scheme:dark){:root{--ink:#e8ecf1;--soft:#9aa6b5;--line:#38424f;--a:#56b4e9;--b:#e69f00;--ok:#2cc295;--bg:#14191f;--card:#1c232b;--bad:#ff8a80}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--bg);max-width:1080px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem;margin-bottom:.3rem}h2{font-size:1.2rem;margin-top:2.2rem;border-bottom:1px solid var(--line)}h3{font-size:1rem;margin:1.4rem 0 .3rem}
table{border-collapse:collapse;width:100%;font-size:.88rem}th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid var(--line);vertical-align:top}
th{color:var(--soft);font-weight:600}td.num{font-variant-numeric:tabular-nums;white-space:nowrap}
.verdict{border-left:4px solid var(--a);background:var(--card);padding:.6rem 1rem}.verdict ul{margin:.4rem 0;padding-left:1.2rem}
.soft{color:var(--soft)}.figures{display:flex;flex-wrap:wrap;gap:.6rem}.card{background:var(--card);border-left:4px solid var(--b);padding:.5rem 1rem;margin:.8rem 0}
.chip{display:inline-block;border-radius:1em;padding:0 .6em;font-size:.8rem;background:var(--card);border:1px solid var(--line);white-space:nowrap}.chip.yes{color:var(--ok);border-color:var(--ok)}.chip.tie{color:var(--b);border-color:var(--b)}
svg{background:transparent;max-width:100%;height:auto}svg text{fill:var(--soft);font-size:10.5px}svg text.name{fill:var(--ink);font-weight:600}
.axis{stroke:var(--line);fill:none}.dots{fill:none;stroke-width:2.2;stroke-linecap:round;stroke-opacity:.7}.line{fill:none;stroke-width:1.3}
.n{stroke:var(--a)}.p{stroke:var(--b)}.h{stroke:var(--ink);fill:var(--ink)}path.h{fill:none}.zero{stroke:var(--line)}
.measured{stroke:var(--ink)}.nominal{stroke:var(--b)}.refitted{stroke:var(--a)}.key{display:inline-block;width:1.4em;height:.25em;margin:0 .3em .2em 1em;background:var(--ink)}
.key.nominal,.key.p{background:var(--b)}.key.refitted,.key.n{background:var(--a)}.cell{fill:var(--b)}.untested{fill:url(#hatch)}rect{stroke:var(--line);stroke-width:.5}
.bar{width:45%}.bar span{display:inline-block;height:.8em}.bar .left{background:var(--a)}.bar .floor{background:var(--ok)}.bar .gone{background:var(--line)}
details{margin:.6rem 0}summary{cursor:pointer;color:var(--soft)}
@media print{details{display:block}}
</style>)";

/// Sentences of the verdict as a list; a full stop inside a number ends none.
std::string verdict_html(const Report& report) {
  const std::string& text = report.verdict.text;
  std::string items;
  std::size_t from = 0;
  for (std::size_t at = text.find(". "); at != std::string::npos; at = text.find(". ", at + 2)) {
    items += "<li>" + html_escape(text.substr(from, at + 1 - from)) + "</li>";
    from = at + 2;
  }
  items += "<li>" + html_escape(text.substr(from)) + "</li>";
  std::string rate =
      "This recording's false-alarm rate was not measured: no placebo twins were run (--placebo "
      "N).";
  // The verdict's own sentences say it where it was measured.
  if (report.verdict.false_alarm_rate) rate.clear();
  return "<div class=\"verdict\"><ul>" + items + "</ul><span class=\"soft\">" + rate +
         "</span></div>";
}

std::string parameters_html(const NamedEffect& e) {
  std::string html;
  std::size_t begins = 0;
  for (const NamedParameter& p : e.parameters) {
    if (p.name.starts_with("begin_")) {
      ++begins;
      continue;
    }
    const std::string runs =
        p.running ? "; free run: " + quantity(*p.running, p.unit) : std::string();
    html += fmt::format("{} = {} <span class=\"soft\">[{}, {}]{}</span><br>", html_escape(p.name),
                        quantity(p.value, p.unit), quantity(p.ci95.first, p.unit),
                        quantity(p.ci95.second, p.unit), runs);
  }
  if (begins > 0)
    html += fmt::format("<span class=\"soft\">{} times in report.json</span>", begins);
  return html;
}

std::string chip_of(const NamedEffect& e) {
  if (e.id == "unknown") return "<span class=\"chip tie\">no name</span>";
  if (e.out_of_tolerance) return "<span class=\"chip yes\">out of tolerance</span>";
  if (!e.ambiguous_with.empty()) return "<span class=\"chip tie\">tied</span>";
  return "<span class=\"chip yes\">named</span>";
}

/// The cheapest recording of the menu that parts an effect from each of its rivals.
std::string experiments_html(const NamedEffect& e) {
  std::string html;
  for (const std::string& rival : e.ambiguous_with) {
    const auto cheapest = cheapest_parting(e.id, rival);
    if (!cheapest) continue;
    html += fmt::format("<br>Cheapest against {}: {}, {:.0f} min.", html_escape(rival),
                        html_escape(cheapest->experiment), cheapest->minutes);
  }
  return html;
}

std::string effects_html(const Report& report) {
  if (report.effects.empty()) return "";
  std::string rows, cards;
  for (const NamedEffect& e : report.effects) {
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td><b>{}</b>{}<br>{}</td><td>{}</td><td>{} &rarr; {}</td>"
        "<td class=\"num\">{:.4f}</td><td class=\"num\">{:.0f} %</td></tr>",
        html_escape(e.joint), e.stage, html_escape(e.id),
        e.from.empty() ? "" : " from " + html_escape(e.from), chip_of(e), parameters_html(e),
        quantity(e.held_out_before, e.unit), quantity(e.held_out_after, e.unit), e.p_value,
        100.0 * e.invariance_spread);
    if (e.ambiguous_with.empty()) continue;
    cards += fmt::format(
        "<div class=\"card\"><b>{}: {} or {}</b><br>This recording cannot tell them apart. To part "
        "them: {}.{} <span class=\"soft\"><code>ravencal suggest</code> says how likely that "
        "is.</span></div>",
        html_escape(e.joint), html_escape(e.id),
        html_escape(fmt::format("{}", fmt::join(e.ambiguous_with, " or "))),
        html_escape(e.separate_by), experiments_html(e));
  }
  return "<h2>What is left out</h2><table><tr><th>joint</th><th>stage</th><th>effect</th>"
         "<th>parameters, 95 %</th><th>held-out error without &rarr; with</th><th>p</th>"
         "<th>spread over circumstances</th></tr>" +
         rows + "</table>" + cards;
}

/// What is in the improved plant and has no name.
std::string kept_html(const Report& report) {
  std::string rows;
  for (const NamedEffect& e : report.kept) {
    rows +=
        fmt::format("<tr><td>{}</td><td>{}</td><td>{}{}</td><td>{}</td><td>{} &rarr; {}</td></tr>",
                    html_escape(e.joint), e.stage, html_escape(e.id),
                    e.from.empty() ? "" : " from " + html_escape(e.from), parameters_html(e),
                    quantity(e.held_out_before, e.unit), quantity(e.held_out_after, e.unit));
  }
  return rows.empty() ? ""
                      : "<h2>Kept without a name</h2><p class=\"soft\">The evidence is too little "
                        "for a name, but held-out stretches and positions are predicted better "
                        "with it. The improved plant has it where the simulation can run "
                        "it.</p><table><tr><th>joint</th>"
                        "<th>stage</th><th>behaves like</th><th>parameters, 95 %</th>"
                        "<th>held-out error without &rarr; with</th></tr>" +
                            rows + "</table>";
}

std::string combinations_html(const Report& report) {
  std::string html;
  for (const Combination& c : report.combinations) {
    std::string product, alone;
    for (const CombinedParameter& p : c.parameters) {
      product += fmt::format("{}{}.{}{}", product.empty() ? "" : " &times; ", html_escape(p.id),
                             html_escape(p.name),
                             p.power == 1.0 ? "" : fmt::format("<sup>{:g}</sup>", p.power));
      alone += fmt::format("{}{} by {:.0f} %", alone.empty() ? "" : ", ", html_escape(p.name),
                           100.0 * p.relative_deviation);
    }
    html += fmt::format(
        "<div class=\"card\"><b>{}, {}: known only together</b><br>{} = {:.4g} [{:.4g}, {:.4g}] "
        "(SI); alone they are uncertain: {}.</div>",
        html_escape(c.joint), c.stage, product, c.value, c.ci95.first, c.ci95.second, alone);
  }
  return html;
}

std::string mismatch_html(const Report& report) {
  if (report.mismatch.empty()) return "";
  std::string rows;
  for (const Mismatch& m : report.mismatch) {
    std::string intervals;
    for (std::size_t i = 0; i < m.interval_s.size() && i < 6; ++i)
      intervals +=
          fmt::format("{:.1f}&ndash;{:.1f} s ", m.interval_s[i].first, m.interval_s[i].second);
    if (m.interval_s.size() > 6) intervals += fmt::format("and {} more", m.interval_s.size() - 6);
    std::string positions;
    const std::string unit = m.stage == "drive" && m.unit == "N"     ? "m"
                             : m.stage == "drive" || m.unit == "rad" ? "rad"
                                                                     : "m";
    for (const Interval& p : m.position)
      positions += quantity(p.first, unit) + " to " + quantity(p.second, unit) + " ";
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"num\">{}</td><td "
        "class=\"num\">{}</td><td class=\"num\">{:.4f}</td></tr>",
        html_escape(m.joint), m.stage, html_escape(fmt::format("{}", fmt::join(m.regime, "; "))),
        intervals, positions, quantity(m.excess_rmse, m.unit), quantity(m.floor, m.unit),
        m.p_value);
  }
  return "<h2>Where</h2><table><tr><th>joint</th><th>stage</th><th>circumstances</th><th>times</th>"
         "<th>positions</th>"
         "<th>excess</th><th>floor</th><th>p</th></tr>" +
         rows + "</table>";
}

std::string held_out_html(const Report& report) {
  std::string rows;
  for (const HeldOut& h : report.held_out) {
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td><td "
        "class=\"num\">{}</td></tr>",
        html_escape(h.joint), h.metric, quantity(h.before, h.unit), quantity(h.after, h.unit),
        quantity(h.floor, h.unit));
  }
  return rows.empty() ? ""
                      : "<h2>On data that no fit saw</h2><table><tr><th>joint</th><th>metric</th>"
                        "<th>plant as it is</th><th>improved</th><th>floor</th></tr>" +
                            rows + "</table>";
}

std::string section(const std::string& title, const std::string& body) {
  return body.empty() ? "" : "<h3>" + title + "</h3>" + body;
}

std::string channels_html(const Report& report) {
  std::string html;
  for (const ChannelPlot& p : report.plots) {
    html += fmt::format("<h2>{}, {}</h2>", html_escape(p.joint), html_escape(p.stage));
    html += section("What each part of the model takes away", waterfall_figure(p));
    html += section(
        "What the plant does not predict <span class=\"soft\"><span class=\"key "
        "n\"></span>negative direction of motion<span class=\"key p\"></span>positive</span>",
        look_alike_figure(p));
    html += section("Where", where_figure(p));
    html += section("The same size in every circumstance?", invariance_figure(p));
    html += section("On rows that the fit did not see", trace_figure(p));
  }
  return html;
}

std::string candidates_html(const Report& report) {
  std::string rows;
  for (const NamedEffect& e : report.effects) {
    if (e.id == "unknown" || !(e.held_out_before > 0.0)) continue;
    const double share = held_out_share(e);
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"num\">{:.2f} %</td><td></td><td "
        "class=\"num\">{:.4f}</td><td class=\"num\">{}</td><td class=\"num\">{:.0f} %</td>"
        "<td>{}</td></tr>",
        html_escape(e.joint), e.stage, html_escape(e.id), 100.0 * share, e.p_value,
        quantity(e.size, e.unit), 100.0 * e.invariance_spread, chip_of(e));
  }
  for (const CandidateRow& c : report.candidates) {
    rows += fmt::format(
        "<tr class=\"soft\"><td>{}</td><td>{}</td><td>{}</td><td class=\"num\">{:.2f} %</td><td "
        "class=\"num\">{:.1f}</td><td class=\"num\">{:.4f}</td><td class=\"num\">{}</td><td></td>"
        "<td>{}</td></tr>",
        html_escape(c.joint), c.stage, html_escape(c.id), 100.0 * c.gain_share, c.z, c.p_value,
        quantity(c.size, c.unit), html_escape(c.outcome));
  }
  return rows.empty()
             ? ""
             : "<h2>Candidates and their gates</h2><details><summary>All candidates at the "
               "last step</summary><table><tr><th>joint</th><th>stage</th><th>effect</th>"
               "<th>held-out gain</th><th>z</th><th>p (max-T)</th><th>size</th>"
               "<th>spread</th><th>outcome</th></tr>" +
                   rows + "</table></details>";
}

/// A bar over three decades from the least limit of the same unit.
std::string limits_html(const Report& report) {
  std::map<std::string, double> least;
  for (const NotFound& n : report.not_found) {
    if (!n.detection_limit || !(*n.detection_limit > 0.0)) continue;
    const auto [it, made] = least.emplace(n.unit, *n.detection_limit);
    it->second = std::min(it->second, *n.detection_limit);
  }
  std::string rows;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> untestable;
  for (const NotFound& n : report.not_found) {
    if (!n.detection_limit) {
      untestable[{n.joint, n.not_testable_because}].push_back(n.id);
      continue;
    }
    const double ratio = *n.detection_limit > 0.0 ? *n.detection_limit / least.at(n.unit) : 1.0;
    const double width = std::clamp(5.0 + 30.0 * std::log10(ratio), 1.0, 100.0);
    rows += fmt::format(
        "<tr><td>{}</td><td>{}</td><td class=\"bar\"><span class=\"floor\" "
        "style=\"width:{:.0f}%\"></span></td><td class=\"num\">{}</td>"
        "<td class=\"soft\">{}</td></tr>",
        html_escape(n.joint), html_escape(n.id), width, quantity(*n.detection_limit, n.unit),
        html_escape(n.parameter));
  }
  std::string html = "<h2>Not found</h2>";
  if (!rows.empty()) {
    html +=
        "<p class=\"soft\">Smallest size that would have been found; bars are logarithmic and "
        "compare effects of one unit.</p><table><tr><th>joint</th><th>effect</th><th></th>"
        "<th>would have been seen from</th><th>parameter</th></tr>" +
        rows + "</table>";
  }
  std::string grey;
  for (const auto& [key, ids] : untestable) {
    grey += fmt::format(
        "<tr class=\"soft\"><td>{}</td><td>{}</td><td>{}</td></tr>", html_escape(key.first),
        html_escape(fmt::format("{}", fmt::join(ids, ", "))), html_escape(key.second));
  }
  if (!grey.empty()) {
    html +=
        "<h3>Not testable with this recording</h3><table><tr><th>joint</th><th>effects</th>"
        "<th>because</th></tr>" +
        grey + "</table>";
  }
  return html;
}

std::string provenance_html(const Report& report) {
  std::string rows;
  for (const auto& [key, value] : report.provenance)
    rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>", html_escape(key), html_escape(value));
  return rows.empty() ? "" : "<h2>Made from</h2><table class=\"soft\">" + rows + "</table>";
}

std::string heading_of(const std::string& kind) {
  std::string words = kind;
  std::replace(words.begin(), words.end(), '_', ' ');
  if (!words.empty())
    words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return words;
}

}  // namespace

std::string report_html(const Report& report) {
  const std::string title = html_escape(heading_of(report.verdict.kind));
  std::string page = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>ravencal diagnose: {0}</title>{1}</head><body>"
      "<h1>{0}</h1>",
      title, kStyle);
  page += figure_definitions() + verdict_html(report) + effects_html(report) + kept_html(report) +
          combinations_html(report) + held_out_html(report) + mismatch_html(report) +
          channels_html(report) + candidates_html(report) + limits_html(report) +
          provenance_html(report);
  return page + "</body></html>\n";
}

}  // namespace ravencal::diagnose
