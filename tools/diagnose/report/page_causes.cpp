// SPDX-License-Identifier: Apache-2.0
//
// One card per physical cause: what it is, how much, on what evidence, what else it may be.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/findings/words.hpp"
#include "diagnose/report/charts.hpp"
#include "diagnose/report/page_parts.hpp"
#include "report/escape.hpp"

namespace ravencal::diagnose {
namespace {

using report::Document;
using report::html_escape;

std::string name_of(const NamedEffect& e) {
  return words_of(e.id) + (e.from.empty() ? "" : " from " + e.from);
}

std::string interval_text(const NamedParameter& p) {
  return fmt::format("{} to {}", quantity(p.ci95.first, p.unit), quantity(p.ci95.second, p.unit));
}

/// The times of single events are too many for a card.
bool is_event(const NamedParameter& p) { return p.name.starts_with("begin_"); }

std::string parameters_html(const NamedEffect& e) {
  std::string rows;
  for (const NamedParameter& p : e.parameters) {
    if (is_event(p)) continue;
    const std::string value = "<b>" + html_escape(quantity(p.value, p.unit)) + "</b>";
    rows += row_html({html_escape(words_of(p.name)), value, html_escape(interval_text(p))});
  }
  return table_html({html_escape(e.joint + ": " + name_of(e)), "value", "95 % interval"}, rows);
}

/// No recording makes a probability of one or zero.
std::string probability_text(double probability) {
  if (probability > 0.995) return "over 99 %";
  if (probability < 0.01) return "below 1 %";
  return fmt::format("{:.0f} %", 100.0 * probability);
}

std::string evidence_html(const NamedEffect& e) {
  const auto fact = [](const char* name, const std::string& value) {
    return fmt::format("<div><dt>{}</dt><dd>{}</dd></div>", name, value);
  };
  std::string html = "<dl class=\"facts-line\">";
  if (e.probability) html += fact("probability", probability_text(*e.probability));
  html += fact("unseen error without &rarr; with",
               change_html(e.held_out_before, e.held_out_after, e.unit));
  if (e.held_out_before > 0.0)
    html +=
        fact("its share of the squared error", fmt::format("{:.1f} %", 100.0 * held_out_share(e)));
  html += fact("p", chance_text(e.p_value));
  html += fact("differs between circumstances by",
               fmt::format("{:.0f} %", 100.0 * e.invariance_spread));
  return html + "</dl>\n";
}

std::string rivals_html(const Report& report, const Cause& cause) {
  std::string rows;
  for (const Parting& p : cause.partings) {
    const std::string minutes =
        p.minutes ? fmt::format(" ({:.0f} min)", *p.minutes) : std::string();
    rows += fmt::format("<li>{} or <b>{}</b>: {}{}</li>", html_escape(words_of(p.id)),
                        html_escape(words_of(p.rival)), html_escape(p.experiment), minutes);
  }
  if (!rows.empty())
    return "<p class=\"lead\">Rivals, and the recording that parts them</p><ul>" + rows + "</ul>\n";
  const NamedEffect& first = report.effects[cause.effects.front()];
  if (first.separate_by.empty()) return "";
  return "<p class=\"lead\">" +
         std::string(cause.status == "no_name" ? "To find its name" : "No rival. To confirm it") +
         "</p><ul><li>" + html_escape(first.separate_by) + "</li></ul>\n";
}

/// The channel that shows the effect: a sensor's is seen between the transmission's two ends.
const ChannelPlot* plot_of(const Report& report, const NamedEffect& e) {
  const std::string stage = e.stage == "sensor" ? "transmission" : e.stage;
  const auto it = std::find_if(report.plots.begin(), report.plots.end(), [&](const ChannelPlot& p) {
    return p.joint == e.joint && p.stage == stage;
  });
  return it == report.plots.end() ? nullptr : &*it;
}

std::string plot_html(const Report& report, const Cause& cause, Document& page) {
  for (const std::size_t i : cause.effects) {
    const NamedEffect& e = report.effects[i];
    const ChannelPlot* plot = plot_of(report, e);
    if (plot == nullptr) continue;
    nlohmann::json spec = residual_chart(*plot, words_for(e.id).abscissa);
    if (spec.is_null()) spec = residual_chart(*plot, Abscissa::kPosition);
    if (spec.is_null()) continue;
    return page.figure_html(spec, "What the plant leaves of " + place_of(*plot),
                            "Each point is a moment; triangles: the joint moves backwards. Before: "
                            "the plant as it is. After: with all that was found.",
                            false);
  }
  return "";
}

std::string status_html(const std::string& status) {
  return fmt::format("<span class=\"chip {}\">{}</span>", status, words_of(status));
}

std::string card_html(const Report& report, const Cause& cause, Document& page) {
  std::string text;
  for (const std::size_t i : cause.effects) {
    text += parameters_html(report.effects[i]) + evidence_html(report.effects[i]);
    const auto& parameters = report.effects[i].parameters;
    const auto events = std::count_if(parameters.begin(), parameters.end(), is_event);
    if (events > 0)
      text += fmt::format("<p class=\"note\">{} times stand in report.json.</p>", events);
  }
  return fmt::format(
      "<article class=\"card\"><h3>{} <span class=\"soft\">{}</span> {}</h3>\n<p>{}</p>\n"
      "<div class=\"narrow-and-wide\"><div>{}{}</div>{}</div></article>\n",
      html_escape(cause.name), html_escape(fmt::format("{}", fmt::join(cause.joints, ", "))),
      status_html(cause.status), html_escape(cause.sentence), text, rivals_html(report, cause),
      plot_html(report, cause, page));
}

}  // namespace

void add_causes(const Report& report, Document& page) {
  const std::vector<Cause> causes = causes_of(report);
  if (causes.empty()) return;
  page.section("causes", "Causes");
  for (const Cause& cause : causes) page.add(card_html(report, cause, page));
}

}  // namespace ravencal::diagnose
