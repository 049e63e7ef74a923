// SPDX-License-Identifier: Apache-2.0
#include "report/study_page.hpp"

#include <fmt/format.h>

#include "core/version.hpp"
#include "core/whole_file.hpp"
#include "report/assets.hpp"
#include "report/escape.hpp"
#include "report/tables.hpp"

namespace ravencal::report {
namespace {

/// The figure's HTML; its chart is appended to `charts`.
std::string figure_html(const StudyFigure& figure, nlohmann::json& charts) {
  const std::string id = fmt::format("chart-{}", charts.size());
  charts.push_back({{"id", id}, {"spec", figure.spec}});
  return fmt::format(
      "<figure><h3>{0}</h3>\n<div class=\"chart wide\" id=\"{1}\" tabindex=\"0\" role=\"group\" "
      "aria-label=\"{0}\"></div>\n<figcaption><p>{2}</p></figcaption></figure>\n",
      html_escape(figure.heading), id, html_escape(figure.caption));
}

std::string paragraph(const char* css_class, const std::string& text) {
  return text.empty() ? "" : fmt::format("<p class=\"{}\">{}</p>", css_class, html_escape(text));
}

}  // namespace

core::Status write_study_html(const StudyPage& page, const std::filesystem::path& path) {
  nlohmann::json charts = nlohmann::json::array();
  std::string body;
  std::string contents = "<nav aria-label=\"contents\"><ul>";
  const auto start_section = [&](const std::string& id, const std::string& title) {
    body += fmt::format("<h2 id=\"{}\">{}</h2>\n", html_escape(id), html_escape(title));
    contents += fmt::format("<li><a href=\"#{}\">{}</a></li>", html_escape(id), html_escape(title));
  };
  for (const StudySection& section : page.sections) {
    start_section(section.id, section.title);
    body += section.html;
    for (const StudyFigure& figure : section.figures) body += figure_html(figure, charts);
  }
  if (!page.provenance.empty() || !page.reproduce.empty()) {
    start_section("provenance", "Provenance");
    if (!page.provenance.empty()) body += facts_html(page.provenance);
    if (!page.reproduce.empty()) {
      body += "<h3>Make this page again</h3>\n<pre>" + html_escape(page.reproduce) + "</pre>\n";
    }
  }
  contents += "</ul></nav>";
  const std::string title = html_escape(page.title);
  const std::string subtitle = paragraph("subtitle", page.subtitle);
  const std::string verdict = paragraph("verdict", page.verdict);
  const std::string charts_text = script_json(charts);
  const std::string licences = html_escape(assets::licences());
  return core::write_whole_file(path, fill_template(assets::html(), {{"version", core::kVersion},
                                                                     {"title", title},
                                                                     {"css", assets::css()},
                                                                     {"subtitle", subtitle},
                                                                     {"verdict", verdict},
                                                                     {"contents", contents},
                                                                     {"body", body},
                                                                     {"licences", licences},
                                                                     {"charts", charts_text},
                                                                     {"js", assets::js()},
                                                                     {"vega", assets::vega()}}));
}

}  // namespace ravencal::report
