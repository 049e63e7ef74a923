// SPDX-License-Identifier: Apache-2.0
//
// Small drawings for the report: axes with round ticks, dots, lines, bars. Plain SVG text, so that
// the page opens anywhere, offline and without scripts; colours come from the page's style.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ravencal::diagnose {

struct Range {
  double from = 0.0;
  double to = 1.0;
};

/// From the least to the greatest finite value, without the outermost `share` on either side.
Range range_of(std::vector<double> values, double share = 0.0);
/// The smallest range that holds both.
Range joined(const Range& a, const Range& b);

/// Degrees and millimetres for people; everything else as it is.
double display_factor(std::string_view unit);
std::string display_unit(std::string_view unit);

struct Frame {
  std::string title, x_title, y_title;
  Range x, y;  ///< in units of display
  double width = 250.0, height = 170.0;
};

class Drawing {
 public:
  explicit Drawing(Frame frame);

  /// Dots outside the frame are drawn on its edge. `style` is a class of the page.
  void dots(const std::vector<double>& x, const std::vector<double>& y, std::string_view style);
  /// NaN breaks the line.
  void line(const std::vector<double>& x, const std::vector<double>& y, std::string_view style);
  void level(double y, std::string_view style);
  /// Horizontal whisker with a dot at `x`.
  void whisker(double x, double half_width, double y, std::string_view style);
  void label(double x, double y, std::string_view text, std::string_view anchor = "start");
  void box(double x0, double y0, double x1, double y1, std::string_view style, double opacity,
           std::string_view tip);

  /// The drawing as an <svg> element.
  [[nodiscard]] std::string finish(bool x_ticks = true, bool y_ticks = true) const;

 private:
  [[nodiscard]] double px(double x) const;
  [[nodiscard]] double py(double y) const;
  [[nodiscard]] std::string axes(bool x_ticks, bool y_ticks) const;

  Frame frame_;
  std::string marks_;
};

}  // namespace ravencal::diagnose
