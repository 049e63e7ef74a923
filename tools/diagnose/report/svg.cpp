// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "report/escape.hpp"

namespace ravencal::diagnose {
namespace {

constexpr double kLeft = 46.0, kRight = 8.0, kTop = 20.0, kBottom = 32.0;

/// About three round numbers inside the range.
std::vector<double> ticks(const Range& range) {
  const double span = range.to - range.from;
  if (!(span > 0.0) || !std::isfinite(span)) return {};
  const double raw = span / 3.0;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = decade;
  for (const double factor : {2.0, 5.0, 10.0}) {
    if (factor * decade <= raw * 1.2) step = factor * decade;
  }
  std::vector<double> out;
  for (double t = std::ceil(range.from / step) * step; t <= range.to + 1e-9 * step; t += step)
    out.push_back(std::abs(t) < 1e-9 * step ? 0.0 : t);
  return out;
}

}  // namespace

Range range_of(std::vector<double> values, double share) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto cut = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const Range r{values[cut], values[values.size() - 1 - cut]};
  if (r.to > r.from) return r;
  const double around = std::max(0.5 * std::abs(r.from), 1e-12);
  return {r.from - around, r.from + around};
}

Range joined(const Range& a, const Range& b) {
  return {std::min(a.from, b.from), std::max(a.to, b.to)};
}

double display_factor(std::string_view unit) {
  if (unit == "rad") return 180.0 / std::numbers::pi;
  return unit == "m" ? 1e3 : 1.0;
}

std::string display_unit(std::string_view unit) {
  if (unit == "rad") return "deg";
  if (unit == "N_m") return "N m";
  return unit == "m" ? "mm" : std::string(unit);
}

Drawing::Drawing(Frame frame) : frame_(std::move(frame)) {}

double Drawing::px(double x) const {
  const double share = (x - frame_.x.from) / (frame_.x.to - frame_.x.from);
  return kLeft + (frame_.width - kLeft - kRight) * std::clamp(share, 0.0, 1.0);
}

double Drawing::py(double y) const {
  const double share = (y - frame_.y.from) / (frame_.y.to - frame_.y.from);
  return kTop + (frame_.height - kTop - kBottom) * (1.0 - std::clamp(share, 0.0, 1.0));
}

void Drawing::dots(const std::vector<double>& x, const std::vector<double>& y,
                   std::string_view style) {
  std::string path;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i]))
      path += fmt::format("M{:.1f} {:.1f}h0", px(x[i]), py(y[i]));
  }
  if (!path.empty()) marks_ += fmt::format("<path class=\"dots {}\" d=\"{}\"/>", style, path);
}

void Drawing::line(const std::vector<double>& x, const std::vector<double>& y,
                   std::string_view style) {
  std::string path;
  bool down = false;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool there = std::isfinite(x[i]) && std::isfinite(y[i]);
    if (there) path += fmt::format("{}{:.1f} {:.1f}", down ? 'L' : 'M', px(x[i]), py(y[i]));
    down = there;
  }
  if (!path.empty()) marks_ += fmt::format("<path class=\"line {}\" d=\"{}\"/>", style, path);
}

void Drawing::level(double y, std::string_view style) {
  marks_ += fmt::format("<path class=\"line {}\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", style, kLeft,
                        py(y), frame_.width - kRight);
}

void Drawing::whisker(double x, double half_width, double y, std::string_view style) {
  marks_ += fmt::format(
      "<path class=\"line {0}\" d=\"M{1:.1f} {3:.1f}H{2:.1f}\"/>"
      "<circle class=\"{0}\" cx=\"{4:.1f}\" cy=\"{3:.1f}\" r=\"3\"/>",
      style, px(x - half_width), px(x + half_width), py(y), px(x));
}

void Drawing::label(double x, double y, std::string_view text, std::string_view anchor) {
  marks_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", px(x),
                        py(y) + 4.0, anchor, report::html_escape(text));
}

void Drawing::box(double x0, double y0, double x1, double y1, std::string_view style,
                  double opacity, std::string_view tip) {
  marks_ += fmt::format(
      "<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
      "fill-opacity=\"{:.2f}\"><title>{}</title></rect>",
      style, px(x0), py(y1), std::max(0.5, px(x1) - px(x0)), std::max(0.5, py(y0) - py(y1)),
      opacity, report::html_escape(tip));
}

std::string Drawing::axes(bool x_ticks, bool y_ticks) const {
  const double bottom = frame_.height - kBottom;
  const double right = frame_.width - kRight;
  std::string out =
      fmt::format("<path class=\"axis\" d=\"M{0} {1}V{2}H{3}\"/>", kLeft, kTop, bottom, right);
  if (x_ticks) {
    for (const double t : ticks(frame_.x))
      out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}</text>",
                         px(t), bottom + 12.0, t);
  }
  if (y_ticks) {
    for (const double t : ticks(frame_.y))
      out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{:.3g}</text>",
                         kLeft - 4.0, py(t) + 4.0, t);
  }
  out += fmt::format("<text class=\"name\" x=\"4\" y=\"12\">{}</text>",
                     report::html_escape(frame_.title));
  out += fmt::format("<text x=\"{:.1f}\" y=\"12\" text-anchor=\"end\">{}</text>", right,
                     report::html_escape(frame_.y_title));
  out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", right,
                     frame_.height - 5.0, report::html_escape(frame_.x_title));
  return out;
}

std::string Drawing::finish(bool x_ticks, bool y_ticks) const {
  return fmt::format(
      "<svg role=\"img\" aria-label=\"{0}\" viewBox=\"0 0 {1} {2}\" width=\"{1}\" "
      "height=\"{2}\"><title>{0}</title>{3}{4}</svg>",
      report::html_escape(frame_.title), frame_.width, frame_.height, axes(x_ticks, y_ticks),
      marks_);
}

}  // namespace ravencal::diagnose
