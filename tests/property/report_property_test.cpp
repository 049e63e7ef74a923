// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "report/reduce.hpp"

namespace ravencal::report {
namespace {

/// Samples with some missing ones, at uneven times, in one or more recordings.
struct Recording {
  std::vector<double> t_s;
  std::vector<double> values;
};

Recording any_recording() {
  Recording recording;
  double t_s = 0.0;
  const auto samples = *rc::gen::inRange(1, 400);
  for (int i = 0; i < samples; ++i) {
    const int step = *rc::gen::inRange(0, 40);
    t_s = step == 0 ? 0.0 : t_s + 0.001 * step;
    recording.t_s.push_back(t_s);
    const int value = *rc::gen::inRange(-1000, 1000);
    recording.values.push_back(value > 900 ? std::numeric_limits<double>::quiet_NaN()
                                           : 0.01 * value);
  }
  return recording;
}

RC_GTEST_PROP(EnvelopeProperty, KeepsTheExtremesOfTheWholeAndDrawsOnlySamples, ()) {
  const Recording recording = any_recording();
  const auto bins = static_cast<std::size_t>(*rc::gen::inRange(1, 100));
  const Timeline timeline = timeline_of(recording.t_s);
  const auto line = envelope(timeline, recording.values, {0, recording.values.size()}, bins);

  std::set<std::pair<double, double>> samples;
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  for (std::size_t i = 0; i < recording.values.size(); ++i) {
    if (std::isnan(recording.values[i])) continue;
    samples.emplace(timeline.t_s[i], recording.values[i]);
    least = std::min(least, recording.values[i]);
    greatest = std::max(greatest, recording.values[i]);
  }
  double least_drawn = std::numeric_limits<double>::infinity();
  double greatest_drawn = -least_drawn;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) RC_ASSERT(line[i].t_s >= line[i - 1].t_s);
    if (std::isnan(line[i].value)) continue;
    RC_ASSERT(samples.contains({line[i].t_s, line[i].value}));
    least_drawn = std::min(least_drawn, line[i].value);
    greatest_drawn = std::max(greatest_drawn, line[i].value);
  }
  RC_ASSERT(least_drawn == least);
  RC_ASSERT(greatest_drawn == greatest);
}

RC_GTEST_PROP(EnvelopeProperty, KeepsTheExtremesOfEveryBinWithinItsBudget, ()) {
  const auto bins = static_cast<std::size_t>(*rc::gen::inRange(1, 40));
  const auto per_bin = static_cast<std::size_t>(*rc::gen::inRange(1, 40));
  std::vector<double> t_s, values;
  std::map<std::size_t, std::pair<double, double>> extremes;
  // Sample i of bin b sits at (i + 0.5) / per_bin within it; the first and the last sample pin the
  // ends of the time axis.
  for (std::size_t b = 0; b < bins; ++b) {
    for (std::size_t i = 0; i < per_bin; ++i) {
      const double within = (static_cast<double>(i) + 0.5) / static_cast<double>(per_bin);
      t_s.push_back(static_cast<double>(b) + within);
      values.push_back(*rc::gen::inRange(-1000, 1000));
      const auto [entry, fresh] = extremes.try_emplace(b, values.back(), values.back());
      if (!fresh) {
        entry->second.first = std::min(entry->second.first, values.back());
        entry->second.second = std::max(entry->second.second, values.back());
      }
    }
  }
  t_s.front() = 0.0;
  t_s.back() = static_cast<double>(bins);
  const Timeline timeline{t_s, {}, {{0, t_s.size()}}, 1.0 / static_cast<double>(per_bin)};
  const auto line = envelope(timeline, values, {0, values.size()}, bins);
  RC_ASSERT(line.size() <= 2 * bins);
  for (const auto& [bin, range] : extremes) {
    const auto drawn = [&, b = static_cast<double>(bin)](double value) {
      return std::any_of(line.begin(), line.end(), [&](const Point& point) {
        return point.value == value && point.t_s >= b && point.t_s <= b + 1;
      });
    };
    RC_ASSERT(drawn(range.first));
    RC_ASSERT(drawn(range.second));
  }
}

RC_GTEST_PROP(HistogramProperty, CountsEverySampleOnce, ()) {
  const Recording recording = any_recording();
  const auto bins = static_cast<std::size_t>(*rc::gen::inRange(1, 60));
  const double half_width = 0.01 * *rc::gen::inRange(1, 2000);
  const auto result = histogram(recording.values, half_width, bins);
  const auto present = std::count_if(recording.values.begin(), recording.values.end(),
                                     [](double value) { return std::isfinite(value); });
  RC_ASSERT(result.counts.size() == bins);
  RC_ASSERT(std::accumulate(result.counts.begin(), result.counts.end(), std::uint64_t{0}) ==
            static_cast<std::uint64_t>(present));
}

RC_GTEST_PROP(ErrorMapProperty, CellsOfAllDirectionsHoldEverySampleAndItsSquares, ()) {
  const Recording error = any_recording();
  const std::size_t samples = error.values.size();
  std::vector<double> x, y;
  std::vector<std::int8_t> direction;
  for (std::size_t i = 0; i < samples; ++i) {
    x.push_back(*rc::gen::inRange(0, 100));
    y.push_back(*rc::gen::inRange(0, 100));
    direction.push_back(static_cast<std::int8_t>(*rc::gen::inRange(-1, 2)));
  }
  const auto grid = grid_over(x, y, 7);
  RC_PRE(grid.has_value());
  std::uint64_t counted = 0;
  double squares = 0.0;
  for (const std::int8_t wanted : {-1, 0, 1}) {
    for (const MapCell& cell : error_map(*grid, x, y, error.values, direction, wanted)) {
      counted += cell.samples;
      squares += cell.rmse * cell.rmse * static_cast<double>(cell.samples);
    }
  }
  const Summary whole = summary_of(error.values);
  RC_ASSERT(counted == whole.samples);
  if (whole.samples > 0) {
    const double expected = whole.rmse * whole.rmse * static_cast<double>(whole.samples);
    RC_ASSERT(std::abs(squares - expected) <= 1e-9 * (1 + expected));  // rounding of < 400 sums
  }
}

}  // namespace
}  // namespace ravencal::report
