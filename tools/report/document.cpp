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

}  // namespace

std::string paragraph_html(std::string_view css_class, const std::string& text) {
  return text.empty() ? "" : fmt::format("<p class=\"{}\">{}</p>", css_class, html_escape(text));
}

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

std::string Document::figure_html(const nlohmann::json& spec, const std::string& heading,
                                  const std::string& caption, bool wide) {
  const std::string id = fmt::format("chart-{}", chart_count_++);
  charts_ += (charts_.empty() ? "" : ",") + script_json({{"id", id}, {"spec", spec}});
  return fmt::format(
      "<figure><h3>{0}</h3>\n<div class=\"chart{1}\" id=\"{2}\" tabindex=\"0\" role=\"group\" "
      "aria-label=\"{0}\"></div>\n<figcaption>{3}</figcaption></figure>\n",
      html_escape(heading), wide ? " wide" : "", id,
      caption.empty() ? "" : "<p>" + html_escape(caption) + "</p>");
}

std::string Document::html(const DocumentHead& head) const {
  const std::string title = html_escape(head.title);
  const std::string subtitle = paragraph_html("subtitle", head.subtitle);
  const std::string verdict = paragraph_html("verdict", head.verdict);
  const std::string contents = contents_html(sections_);
  const std::string charts = "[" + charts_ + "]";
  const std::string licences = html_escape(assets::licences());
  return fill_template(assets::html(), {{"version", core::kVersion},
                                        {"title", title},
                                        {"css", assets::css()},
                                        {"subtitle", subtitle},
                                        {"verdict", verdict},
                                        {"contents", contents},
                                        {"body", body_},
                                        {"licences", licences},
                                        {"charts", charts},
                                        {"js", assets::js()},
                                        {"vega", assets::vega()}});
}

}  // namespace ravencal::report
