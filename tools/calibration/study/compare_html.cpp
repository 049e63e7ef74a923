// SPDX-License-Identifier: Apache-2.0
//
// compare.html: verdict, bars with intervals, error maps, tables. One file without scripts; colours
// and fonts are those of the other reports.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/version.hpp"
#include "core/whole_file.hpp"
#include "report/assets.hpp"
#include "report/escape.hpp"
#include "study/compare.hpp"
#include "study/compare_tables.hpp"

namespace ravencal::study {
namespace {

using report::html_escape;

/// Of every method that is done, the figure of joint k.
struct Bar {
  const MethodResult* method;
  const CompareFigure* figure;
};

std::vector<Bar> bars_of(const Comparison& c, std::size_t k) {
  std::vector<Bar> bars;
  for (const MethodResult& m : c.methods) {
    if (m.status == CompareStatus::kDone && std::isfinite(m.joints[k].sets.at("test").rmse))
      bars.push_back({&m, &m.joints[k].sets.at("test")});
  }
  return bars;
}

/// One bar per method on a logarithmic axis: RMSE with its interval, the peak as a tick.
std::string bar_chart(const std::vector<Bar>& bars, const CompareJoint& joint) {
  constexpr double kLeft = 190, kWidth = 520, kRow = 21, kTop = 6;
  double low = 1e300;
  double high = 0.0;
  for (const Bar& bar : bars) {
    low = std::min({low, bar.figure->rmse,
                    std::isfinite(bar.figure->rmse_low) ? bar.figure->rmse_low : 1e300});
    high = std::max(high, bar.figure->peak);
  }
  low = std::pow(10.0, std::floor(2.0 * std::log10(std::max(low, 1e-9) * 0.9)) / 2.0);
  high = std::max(high * 1.05, low * 10.0);
  const auto x = [&](double v) {
    const double share = std::log(std::max(v, low) / low) / std::log(high / low);
    return kLeft + share * (kWidth - kLeft - 10.0);
  };
  const double height = kTop + kRow * static_cast<double>(bars.size());
  std::string svg = fmt::format(
      "<figure><svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" style=\"max-width:100%;height:auto\" "
      "role=\"img\" aria-label=\"RMSE and peak of {2} by method\">",
      kWidth, height + 34, html_escape(joint.joint));
  for (double tick = std::pow(10.0, std::ceil(std::log10(low))); tick <= high; tick *= 10.0) {
    svg += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"var(--grid)\"/>"
        "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:g}</text>",
        x(tick), kTop, height, height + 14, tick);
  }
  double y = kTop;
  for (const Bar& bar : bars) {
    const CompareFigure& f = *bar.figure;
    const char* colour = bar.method->ours ? "var(--corrected)" : "var(--truth)";
    svg += fmt::format(
        "<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\">{2}</text>"
        "<rect x=\"{3}\" y=\"{4}\" width=\"{5:.1f}\" height=\"12\" fill=\"{6}\"/>",
        kLeft - 6, y + 14, html_escape(bar.method->title), kLeft, y + 4,
        std::max(1.0, x(f.rmse) - kLeft), colour);
    if (std::isfinite(f.rmse_low) && std::isfinite(f.rmse_high)) {
      svg += fmt::format(
          "<path d=\"M{0:.1f} {1}H{2:.1f}M{0:.1f} {3}v8M{2:.1f} {3}v8\" stroke=\"currentColor\" "
          "fill=\"none\"/>",
          x(f.rmse_low), y + 10, x(f.rmse_high), y + 6);
    }
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1}v12\" stroke=\"var(--raw)\" stroke-width=\"2\"><title>{2}: RMSE "
        "{3:.4g}, "
        "peak {4:.4g} {5}</title></path>",
        x(f.peak), y + 4, html_escape(bar.method->title), f.rmse, f.peak, html_escape(joint.unit));
    y += kRow;
  }
  return svg + fmt::format(
                   "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">error [{}], "
                   "logarithmic</text></svg></figure>",
                   0.5 * (kLeft + kWidth), height + 30, html_escape(joint.unit));
}

std::string bars_html(const Comparison& c) {
  std::string html =
      "<h2 id=\"bars\">Errors by method</h2><p class=\"note\">Bars: RMSE on the test recordings, "
      "with "
      "95 % intervals; <span style=\"color:var(--corrected)\">ours</span> and <span "
      "style=\"color:var(--truth)\">others'</span>. <span style=\"color:var(--raw)\">Ticks</span>: "
      "the largest error.</p><div class=\"pair\">";
  const auto done = std::find_if(c.methods.begin(), c.methods.end(), [](const MethodResult& m) {
    return m.status == CompareStatus::kDone;
  });
  for (std::size_t k = 0; k < done->joints.size(); ++k)
    html += "<div><h3>" + html_escape(done->joints[k].joint) + "</h3>" +
            bar_chart(bars_of(c, k), done->joints[k]) + "</div>";
  return html + "</div>";
}

/// One map: cells from light to dark by RMSE up to `most`.
std::string map_svg(const Comparison& c, const CompareMap& map, double most,
                    const std::string& title) {
  constexpr double kCell = 13;
  const auto n = static_cast<double>(c.map_cells);
  std::string svg = fmt::format(
      "<figure style=\"margin:0\"><svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" role=\"img\" "
      "aria-label=\"{2}\">",
      n * kCell, n * kCell, html_escape(title));
  for (std::size_t i = 0; i < map.rmse.size(); ++i) {
    const double x = static_cast<double>(i % c.map_cells) * kCell;
    const double y = (n - 1.0 - static_cast<double>(i / c.map_cells)) * kCell;
    const bool known = std::isfinite(map.rmse[i]);
    svg += fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\" fill-opacity=\"{:.3f}\">"
        "<title>{}</title></rect>",
        x, y, kCell - 0.5, kCell - 0.5, known ? "var(--raw)" : "url(#untested)",
        known ? 0.06 + 0.94 * std::min(1.0, map.rmse[i] / most) : 1.0,
        known ? fmt::format("{:.3g} {}", map.rmse[i], map.unit) : std::string("not tested"));
  }
  return svg + "</svg><figcaption>" + html_escape(title) + "</figcaption></figure>";
}

std::string maps_html(const Comparison& c) {
  if (c.map_cells == 0) return {};
  std::string html = fmt::format(
      "<h2 id=\"maps\">Where the error is</h2><p class=\"note\">RMSE over the positions of {} (to "
      "the right) "
      "and {} (up). Darkest: the largest of the joint's maps but the raw one; hatched: not "
      "tested.</p>",
      html_escape(c.map_x), html_escape(c.map_y));
  const auto done = std::find_if(c.methods.begin(), c.methods.end(), [](const MethodResult& m) {
    return m.status == CompareStatus::kDone && !m.maps.empty();
  });
  if (done == c.methods.end()) return {};
  for (std::size_t k = 0; k < done->maps.size(); ++k) {
    html += "<h3>" + html_escape(done->maps[k].joint) + " [" + html_escape(done->maps[k].unit) +
            "]</h3><div style=\"display:flex;flex-wrap:wrap;gap:.6rem 1rem\">";
    double most = 1e-300;
    for (const MethodResult& m : c.methods) {
      if (m.status != CompareStatus::kDone || m.id == "raw") continue;
      for (const double v : m.maps[k].rmse)
        if (std::isfinite(v)) most = std::max(most, v);
    }
    for (const MethodResult& m : c.methods) {
      if (m.status == CompareStatus::kDone && k < m.maps.size())
        html += map_svg(c, m.maps[k], most, m.title);
    }
    html += "</div>";
  }
  return html;
}

std::string methods_html(const Comparison& c) {
  std::string html =
      "<h2 id=\"methods\">Methods</h2><div class=\"scroll\"><table class=\"facts\"><thead><tr>"
      "<th>method</th><th>after</th><th>what training chose, or why there is nothing</th>"
      "<th>why not in the loop</th></tr></thead><tbody>";
  for (const MethodResult& m : c.methods) {
    const std::string& why = m.loop.loadable ? m.loop.why_not_measured : m.loop.why_not;
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td></tr>",
                        html_escape(m.title), html_escape(m.source),
                        html_escape(m.status == CompareStatus::kDone ? m.remark : m.reason),
                        html_escape(why));
  }
  return html + "</tbody></table></div>";
}

std::string facts_html(const Comparison& c) {
  std::string html =
      "<h2 id=\"facts\">Recordings and settings</h2><div class=\"scroll\"><table "
      "class=\"facts\"><tbody>";
  for (const auto& [name, value] : c.facts)
    html += "<tr><th scope=\"row\">" + html_escape(name) + "</th><td>" + html_escape(value) +
            "</td></tr>";
  return html + "</tbody></table></div>";
}

}  // namespace

std::string comparison_html(const Comparison& c) {
  const std::string title = html_escape(c.title.empty() ? "Comparison of methods" : c.title);
  std::string body = "<p class=\"verdict\">" + html_escape(verdict_text(c)) + "</p>";
  const std::vector<Table> tables = comparison_tables(c);
  if (!tables.empty()) {
    body += bars_html(c);
    body += "<h2 id=\"tables\">Figures</h2>";
    for (const Table& table : tables) body += to_html(table);
    body += maps_html(c);
  }
  body += methods_html(c) + facts_html(c);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta "
      "http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; base-uri 'none'; form-action 'none'\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light "
      "dark\"><title>{0}</title><style>\n{1}\nsvg text{{fill:currentColor;font-size:11px}}"
      "figure{{margin:0 0 .6rem}}</style></head><body>"
      "<svg width=\"0\" height=\"0\" aria-hidden=\"true\" class=\"definitions\"><defs><pattern "
      "id=\"untested\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" "
      "patternTransform=\"rotate(45)\"><path d=\"M0 0V6\" class=\"hatch\"/></pattern></defs></svg>"
      "<header><h1>{0}</h1></header><main>{2}</main><footer><p>Made by ravencal {3}. This page is "
      "one "
      "file and loads nothing.</p></footer></body></html>\n",
      title, report::assets::css(), body, core::kVersion);
}

core::Status write_comparison(const Comparison& c, const std::filesystem::path& folder) {
  const std::vector<Table> tables = comparison_tables(c);
  std::string markdown = verdict_text(c) + "\n\n";
  std::string latex;
  for (const Table& table : tables) {
    markdown += to_markdown(table) + "\n";
    latex += to_latex(table) + "\n";
  }
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "compare.json", comparison_json(c)));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "compare.csv", to_csv(tables)));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "compare.md", markdown));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "compare.tex", latex));
  return core::write_whole_file(folder / "compare.html", comparison_html(c));
}

}  // namespace ravencal::study
