// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnose/report/svg.hpp"

namespace ravencal::diagnose {
namespace {

using Values = std::vector<double>;

Values scaled_by(const Values& x, double factor) {
  Values out = x;
  for (double& v : out) v *= factor;
  return out;
}

/// Entries whose direction of motion is negative, or not.
Values side_of(const Values& x, const Values& direction, bool negative) {
  Values out;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if ((direction[i] < 0.0) == negative) out.push_back(x[i]);
  }
  return out;
}

/// One scatter plot by direction.
std::string scatter(const ChannelPlot& plot, const Values& x, const Values& y, Frame frame) {
  if (x.size() != y.size() || x.empty()) return "";
  frame.x = range_of(x);
  Drawing drawing(std::move(frame));
  drawing.level(0.0, "zero");
  for (const bool negative : {true, false}) {
    drawing.dots(side_of(x, plot.direction, negative), side_of(y, plot.direction, negative),
                 negative ? "n" : "p");
  }
  return drawing.finish();
}

/// Residual on holds over the logarithm of the time since the stop.
std::string holds(const ChannelPlot& plot, const Values& y, Frame frame) {
  Values x, on_hold;
  for (std::size_t i = 0; i < y.size(); ++i) {
    if (plot.hold_s[i] < 0.05) continue;
    x.push_back(std::log10(plot.hold_s[i]));
    on_hold.push_back(y[i]);
  }
  if (x.size() < 20) return "";
  frame.x = range_of(x);
  Drawing drawing(std::move(frame));
  drawing.level(0.0, "zero");
  drawing.dots(x, on_hold, "h");
  return drawing.finish();
}

std::string row_of(const ChannelPlot& plot, const Values& residual, const Range& y,
                   const std::string& title) {
  const double angle = display_factor(plot.position_unit);
  const std::string unit = display_unit(plot.position_unit);
  const auto frame = [&](const std::string& x_title) {
    return Frame{title, x_title, display_unit(plot.unit), {}, y};
  };
  std::string html =
      scatter(plot, scaled_by(plot.position, angle), residual, frame("position, " + unit));
  html += scatter(plot, plot.load, residual,
                  frame("transmitted effort, " + display_unit(plot.load_unit)));
  html += scatter(plot, scaled_by(plot.speed, angle), residual, frame("speed, " + unit + "/s"));
  html += holds(plot, residual, frame("at rest for, log10 s"));
  return html;
}

std::string map_of(const ChannelPlot& plot, const Values& cells, double top,
                   const std::string& title) {
  const WhereMap& map = plot.where;
  const double angle = display_factor(plot.position_unit);
  const double factor = display_factor(plot.unit);
  const std::string unit = display_unit(plot.position_unit);
  Frame frame{title, "position, " + unit, "speed, " + unit + "/s", {}, {}, 420.0, 190.0};
  frame.x = {angle * map.position_edges.front(), angle * map.position_edges.back()};
  frame.y = {angle * map.speed_edges.front(), angle * map.speed_edges.back()};
  Drawing drawing(frame);
  const std::size_t columns = map.position_edges.size() - 1;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::size_t row = c / columns;
    const std::size_t column = c % columns;
    const bool tested = std::isfinite(cells[c]);
    const std::string tip =
        tested ? fmt::format("{:.3g} {}", factor * cells[c], display_unit(plot.unit))
               : std::string("too little data");
    drawing.box(angle * map.position_edges[column], angle * map.speed_edges[row],
                angle * map.position_edges[column + 1], angle * map.speed_edges[row + 1],
                tested ? "cell" : "untested", tested ? std::min(1.0, cells[c] / top) : 1.0, tip);
  }
  return drawing.finish();
}

}  // namespace

std::string figure_definitions() {
  return "<svg width=\"0\" height=\"0\" style=\"position:absolute\" aria-hidden=\"true\"><defs>"
         "<pattern id=\"hatch\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" "
         "patternTransform=\"rotate(45)\"><path class=\"axis\" d=\"M0 0V6\"/></pattern>"
         "</defs></svg>";
}

std::string where_figure(const ChannelPlot& plot) {
  const WhereMap& map = plot.where;
  if (map.before.empty()) return "";
  double top = 0.0;
  for (const Values* cells : {&map.before, &map.after}) {
    for (const double v : *cells) top = std::isfinite(v) ? std::max(top, v) : top;
  }
  if (!(top > 0.0)) return "";
  const std::string scale =
      fmt::format("<p class=\"soft\">Full colour: {:.3g} {}; hatched: too little data.</p>",
                  top * display_factor(plot.unit), display_unit(plot.unit));
  return "<div class=\"figures\">" + map_of(plot, map.before, top, "before") +
         map_of(plot, map.after, top, "after") + "</div>" + scale;
}

std::string look_alike_figure(const ChannelPlot& plot) {
  if (plot.before.empty()) return "";
  const double factor = display_factor(plot.unit);
  const Values before = scaled_by(plot.before, factor);
  const Values after = scaled_by(plot.after, factor);
  // A constant error must not hide the shape of the rest.
  const Range y_before = range_of(before, 0.005);
  const Range y_after = range_of(after, 0.005);
  const double half = 0.5 * std::max(y_before.to - y_before.from, 1e-12);
  const double middle = 0.5 * (y_after.from + y_after.to);
  const bool shifted = y_before.from > 0.0 || y_before.to < 0.0;
  const Range lower = shifted ? Range{middle - half, middle + half} : joined(y_before, y_after);
  const Range upper = shifted ? y_before : lower;
  return "<div class=\"figures\">" + row_of(plot, before, upper, "before") +
         "</div><div class=\"figures\">" + row_of(plot, after, lower, "after") + "</div>";
}

std::string waterfall_figure(const ChannelPlot& plot) {
  const auto& steps = plot.waterfall;
  if (steps.size() < 2) return "";
  const double factor = display_factor(plot.unit);
  double top = 0.0;
  for (const WaterfallStep& s : steps) top = std::max(top, s.rms * s.rms);
  if (!(top > 0.0)) return "";
  std::string rows;
  double last = 0.0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const double share = 100.0 * steps[k].rms * steps[k].rms / top;
    const bool fell = k > 0 && share < last;
    rows += fmt::format(
        "<tr><td>{}</td><td class=\"bar\"><span class=\"{}\" style=\"width:{:.2f}%\"></span>"
        "<span class=\"gone\" style=\"width:{:.2f}%\"></span></td><td>{:.3g} {}</td>"
        "<td>{:.1f} %</td></tr>",
        steps[k].name, k + 1 == steps.size() ? "floor" : "left", share, fell ? last - share : 0.0,
        factor * steps[k].rms, display_unit(plot.unit), share);
    last = share;
  }
  return "<table class=\"fall\"><tr><th></th><th>share of the held-out squared error</th><th>RMS"
         "</th><th>share</th></tr>" +
         rows + "</table>";
}

std::string invariance_figure(const ChannelPlot& plot) {
  if (plot.scales.empty()) return "";
  std::string html;
  for (std::size_t first = 0; first < plot.scales.size();) {
    std::size_t last = first;
    Values ends = {0.5, 1.5};
    while (last < plot.scales.size() && plot.scales[last].effect == plot.scales[first].effect) {
      const RegimeScale& s = plot.scales[last++];
      ends.push_back(std::clamp(s.scale - 2.0 * s.error, -1.0, 3.0));
      ends.push_back(std::clamp(s.scale + 2.0 * s.error, -1.0, 3.0));
    }
    const auto count = static_cast<double>(last - first);
    Frame frame{plot.scales[first].effect + ", size by circumstance",
                "of its size on all data",
                "",
                range_of(ends),
                {0.0, count},
                420.0,
                60.0 + 16.0 * count};
    frame.x.from -= 0.9 * (frame.x.to - frame.x.from);  // room for the names
    Drawing drawing(frame);
    for (std::size_t i = first; i < last; ++i) {
      const RegimeScale& s = plot.scales[i];
      const double y = count - static_cast<double>(i - first) - 0.5;
      drawing.whisker(s.scale, 1.96 * s.error, y, "h");
      drawing.label(frame.x.from + 0.01 * (frame.x.to - frame.x.from), y, s.regime);
    }
    drawing.line({1.0, 1.0}, {0.0, count}, "zero");
    html += drawing.finish(true, false);
    first = last;
  }
  return "<div class=\"figures\">" + html + "</div>";
}

std::string trace_figure(const ChannelPlot& plot) {
  const Trace& t = plot.trace;
  if (t.t_s.size() < 10) return "";
  const double factor = display_factor(plot.unit);
  const Values measured = scaled_by(t.measured, factor);
  const Values nominal = scaled_by(t.nominal, factor);
  const Values refitted = scaled_by(t.refitted, factor);
  const std::string unit = display_unit(plot.unit);
  Frame frame{t.cross_validated ? "rows of each fold under the fit to the others" : "held-out rows",
              "time, s",
              unit,
              range_of(t.t_s),
              {},
              1040.0,
              190.0};
  frame.y = joined(range_of(measured, 0.002), joined(range_of(nominal), range_of(refitted, 0.002)));
  Drawing top(frame);
  top.line(t.t_s, nominal, "nominal");
  top.line(t.t_s, measured, "measured");
  top.line(t.t_s, refitted, "refitted");
  Values was, left;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    was.push_back(measured[i] - nominal[i]);
    left.push_back(measured[i] - refitted[i]);
  }
  Frame strip{"what is left", "time, s", unit, frame.x, {}, 1040.0, 120.0};
  strip.y = joined(range_of(was, 0.01), range_of(left, 0.01));
  Drawing bottom(strip);
  bottom.level(0.0, "zero");
  bottom.line(t.t_s, was, "nominal");
  bottom.line(t.t_s, left, "refitted");
  return "<div class=\"figures\">" + top.finish() + bottom.finish() +
         "</div><p class=\"soft\"><span class=\"key measured\"></span>measured <span class=\"key "
         "nominal\"></span>plant as it is <span class=\"key refitted\"></span>improved</p>";
}

}  // namespace ravencal::diagnose
