// SPDX-License-Identifier: Apache-2.0
#include "report/document.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/version.hpp"
#include "report/assets.hpp"
#include "report/escape.hpp"
#include "report/tables.hpp"

namespace ravencal::report {
namespace {

std::string contents_html(const std::vector<std::pair<std::string, std::string>>& sections) {
  if (sections.size() < 2) return "";
  std::string html = "<nav aria-label=\"contents\"><ul>";
  for (const auto& [id, title] : sections) {
    html += fmt::format("<li><a href=\"#{}\">{}</a></li>", html_escape(id), html_escape(title));
  }
  return html + "</ul></nav>";
}

/// Text as a <p> of that class; nothing if it is empty.
std::string paragraph_html(std::string_view css_class, const std::string& text) {
  return text.empty() ? "" : fmt::format("<p class=\"{}\">{}</p>", css_class, html_escape(text));
}

/// The template with what every page has.
std::string page_html(std::vector<std::pair<std::string_view, std::string>> parts) {
  parts.insert(parts.end(), {{"version", core::kVersion},
                             {"css", std::string(assets::css())},
                             {"licences", html_escape(assets::licences())},
                             {"js", fmt::format("{}{}", assets::js(), assets::draw())},
                             {"vega", std::string(assets::vega())}});
  return fill_template(assets::html(), {parts.begin(), parts.end()});
}

}  // namespace

std::string key_item_html(const char* colour, const char* dash, double width,
                          const std::string& html) {
  return fmt::format(
      "<li><svg viewBox=\"0 0 26 9\" aria-hidden=\"true\"><path d=\"M0 4.5H26\" fill=\"none\" "
      "stroke=\"{}\" stroke-width=\"{}\" stroke-dasharray=\"{}\"/></svg>{}</li>",
      colour, width, dash, html);
}

void Document::section(const std::string& id, const std::string& title) {
  sections_.emplace_back(id, title);
  body_ += fmt::format("<h2 id=\"{}\">{}</h2>\n", html_escape(id), html_escape(title));
}

void Document::note(const std::string& text) { body_ += paragraph_html("note", text) + "\n"; }

void Document::provenance(const std::vector<std::pair<std::string, std::string>>& facts,
                          const std::string& reproduce) {
  if (facts.empty() && reproduce.empty()) return;
  section("provenance", "Provenance");
  if (!facts.empty()) body_ += facts_html(facts);
  if (!reproduce.empty()) {
    body_ += "<h3>Make this page again</h3>\n<pre>" + html_escape(reproduce) + "</pre>\n";
  }
}

void Document::figure(const nlohmann::json& spec, const std::string& heading,
                      const std::string& caption, bool wide) {
  const std::string id = fmt::format("chart-{}", chart_count_++);
  charts_ += (charts_.empty() ? "" : ",") + script_json({{"id", id}, {"spec", spec}});
  body_ += fmt::format(
      "<figure><h3>{0}</h3>\n<div class=\"chart{1}\" id=\"{2}\" tabindex=\"0\" role=\"group\" "
      "aria-label=\"{0}\"></div>\n<figcaption>{3}</figcaption></figure>\n",
      html_escape(heading), wide ? " wide" : "", id,
      caption.empty() ? "" : "<p>" + html_escape(caption) + "</p>");
}

std::string Document::html(const DocumentHead& head) const {
  return page_html({{"title", html_escape(head.title)},
                    {"subtitle", paragraph_html("subtitle", head.subtitle)},
                    {"verdict", paragraph_html("verdict", head.verdict)},
                    {"contents", contents_html(sections_)},
                    {"without_scripts",
                     "The charts are drawn by scripts inside this page; this browser does not run "
                     "them. The tables are complete."},
                    {"body", body_},
                    {"data_id", "charts"},
                    {"data", "[" + charts_ + "]"},
                    {"start", "draw_charts();"}});
}

std::string drawn_html(const std::string& title, const std::string& data_json,
                       const std::string& data_files, std::string_view script) {
  return page_html({{"title", html_escape(title)},
                    {"subtitle", ""},
                    {"verdict", ""},
                    {"contents", ""},
                    {"without_scripts",
                     "This page is drawn by scripts inside it; this browser does not run them. All "
                     "that it shows stands in " +
                         html_escape(data_files) + "."},
                    {"body", ""},
                    {"data_id", "data"},
                    {"data", script_text(data_json)},
                    {"start", std::string(script)}});
}

}  // namespace ravencal::report
