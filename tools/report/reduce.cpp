// SPDX-License-Identifier: Apache-2.0
#include "report/reduce.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/median.hpp"
#include "core/require.hpp"

namespace ravencal::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double median_rise(std::span<const double> t_s) {
  std::vector<double> rises;
  for (std::size_t i = 1; i < t_s.size(); ++i) {
    if (t_s[i] > t_s[i - 1]) rises.push_back(t_s[i] - t_s[i - 1]);
  }
  if (rises.empty()) return 0.0;
  return core::upper_median(std::move(rises));
}

/// Collects a bin's extremes and appends them to a polyline.
class BinExtremes {
 public:
  explicit BinExtremes(std::vector<Point>& line) : line_(line) {}

  void add(const Point& point) {
    ++seen_;
    if (!std::isfinite(point.value)) return;
    if (finite_++ == 0) {
      least_ = greatest_ = point;
    } else if (point.value < least_.value) {
      least_ = point;
    } else if (point.value > greatest_.value) {
      greatest_ = point;
    }
  }

  void flush() {
    if (finite_ > 0) {
      const bool least_first = least_.t_s <= greatest_.t_s;
      line_.push_back(least_first ? least_ : greatest_);
      if (least_.value < greatest_.value) line_.push_back(least_first ? greatest_ : least_);
    } else if (seen_ > 0) {
      interrupt();
    }
    seen_ = finite_ = 0;
  }

  void interrupt() {
    if (!line_.empty() && std::isfinite(line_.back().value)) {
      line_.push_back({line_.back().t_s, kNan});
    }
  }

 private:
  std::vector<Point>& line_;
  Point least_, greatest_;
  std::size_t seen_ = 0;
  std::size_t finite_ = 0;
};

std::size_t cell_index(double value, double from, double to, std::size_t cells) {
  const double position = (value - from) / (to - from) * static_cast<double>(cells);
  return static_cast<std::size_t>(std::clamp(position, 0.0, static_cast<double>(cells - 1)));
}

/// Range that holds the middle 95 % of the finite values.
double range_95(std::span<const double> values) {
  std::vector<double> finite;
  std::copy_if(values.begin(), values.end(), std::back_inserter(finite),
               [](double value) { return std::isfinite(value); });
  if (finite.empty()) return 0.0;
  const auto at = [&finite](double share) {
    const auto nth = finite.begin() +
                     static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
    std::nth_element(finite.begin(), nth, finite.end());
    return *nth;
  };
  return at(0.975) - at(0.025);
}

/// -1 or +1 where |value| > threshold, else 0.
std::int8_t sign_beyond(double value, double threshold) {
  if (!(std::abs(value) > threshold)) return 0;
  return value > 0 ? 1 : -1;
}

IndexRange window_around(const Timeline& timeline, IndexRange stretch, std::size_t centre,
                         double duration_s) {
  const auto& t = timeline.t_s;
  const double latest_start = t[stretch.end - 1] - duration_s;
  const double start =
      std::max(t[stretch.begin], std::min(t[centre] - duration_s / 2, latest_start));
  const auto at = [&t, stretch](double time) {
    const auto first = t.begin() + static_cast<std::ptrdiff_t>(stretch.begin);
    const auto last = t.begin() + static_cast<std::ptrdiff_t>(stretch.end);
    return static_cast<std::size_t>(std::lower_bound(first, last, time) - t.begin());
  };
  return {at(start), at(start + duration_s)};
}

}  // namespace

Timeline timeline_of(std::span<const double> t_s) {
  Timeline timeline;
  timeline.period_s = median_rise(t_s);
  timeline.t_s.reserve(t_s.size());
  const double longest_step_s = std::max(20 * timeline.period_s, 0.1);
  double shift_s = 0.0;
  std::size_t stretch_begin = 0;
  for (std::size_t i = 0; i < t_s.size(); ++i) {
    if (i > 0) {
      const bool next_recording = t_s[i] < t_s[i - 1];
      if (next_recording) {
        shift_s = timeline.t_s.back() + timeline.period_s - t_s[i];
        timeline.recording_starts.push_back(t_s[i] + shift_s);
      }
      if (next_recording || t_s[i] - t_s[i - 1] > longest_step_s) {
        timeline.stretches.push_back({stretch_begin, i});
        stretch_begin = i;
      }
    }
    timeline.t_s.push_back(t_s[i] + shift_s);
  }
  if (!t_s.empty()) timeline.stretches.push_back({stretch_begin, t_s.size()});
  return timeline;
}

std::vector<Point> envelope(const Timeline& timeline, std::span<const double> values,
                            IndexRange range, std::size_t bins) {
  core::require(values.size() == timeline.t_s.size() && range.end <= values.size() && bins > 0,
                "an envelope needs a value for each time, a range within them and a bin");
  std::vector<Point> line;
  if (range.begin >= range.end) return line;
  const double from = timeline.t_s[range.begin];
  const double to = timeline.t_s[range.end - 1];
  const auto bin_of = [&](std::size_t i) {
    return to > from ? cell_index(timeline.t_s[i], from, to, bins) : 0;
  };
  BinExtremes extremes(line);
  for (const IndexRange& stretch : timeline.stretches) {
    const std::size_t begin = std::max(stretch.begin, range.begin);
    const std::size_t end = std::min(stretch.end, range.end);
    for (std::size_t i = begin; i < end; ++i) {
      if (i > begin && bin_of(i) != bin_of(i - 1)) extremes.flush();
      extremes.add({timeline.t_s[i], values[i]});
    }
    extremes.flush();
    extremes.interrupt();
  }
  while (!line.empty() && !std::isfinite(line.back().value)) line.pop_back();
  return line;
}

Histogram histogram(std::span<const double> values, double half_width, std::size_t bins) {
  core::require(half_width > 0 && bins > 0, "a histogram needs a width and a bin");
  Histogram result{-half_width, 2 * half_width / static_cast<double>(bins), {}};
  result.counts.resize(bins);
  for (const double value : values) {
    if (std::isfinite(value)) ++result.counts[cell_index(value, -half_width, half_width, bins)];
  }
  return result;
}

std::vector<QuantilePoint> magnitude_quantiles(std::span<const double> values, std::size_t points) {
  core::require(points >= 2, "quantiles need two points");
  std::vector<double> magnitudes;
  for (const double value : values) {
    if (std::isfinite(value)) magnitudes.push_back(std::abs(value));
  }
  std::vector<QuantilePoint> result;
  if (magnitudes.empty()) return result;
  std::sort(magnitudes.begin(), magnitudes.end());
  for (std::size_t k = 1; k <= points; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(points);
    const double rank = std::ceil(share * static_cast<double>(magnitudes.size()));
    const auto index =
        std::clamp<std::size_t>(static_cast<std::size_t>(rank), 1, magnitudes.size());
    result.push_back({magnitudes[index - 1], share});
  }
  return result;
}

Summary summary_of(std::span<const double> values) {
  Summary result;
  double squares = 0.0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    ++result.samples;
    squares += value * value;
    result.peak = std::max(result.peak, std::abs(value));
  }
  if (result.samples == 0) return {0, kNan, kNan};
  result.rmse = std::sqrt(squares / static_cast<double>(result.samples));
  return result;
}

std::optional<MapGrid> grid_over(std::span<const double> x, std::span<const double> y,
                                 std::size_t cells) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  MapGrid grid{kInfinity, -kInfinity, kInfinity, -kInfinity, cells, cells};
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    grid.x_from = std::min(grid.x_from, x[i]);
    grid.x_to = std::max(grid.x_to, x[i]);
    grid.y_from = std::min(grid.y_from, y[i]);
    grid.y_to = std::max(grid.y_to, y[i]);
  }
  if (!(grid.x_to > grid.x_from) || !(grid.y_to > grid.y_from)) return std::nullopt;
  return grid;
}

std::vector<double> edges_of(double from, double to, std::size_t cells) {
  std::vector<double> edges;
  for (std::size_t i = 0; i <= cells; ++i)
    edges.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(cells));
  return edges;
}

std::vector<MapCell> error_map(const MapGrid& grid, std::span<const double> x,
                               std::span<const double> y, std::span<const double> error,
                               std::span<const std::int8_t> direction, std::int8_t wanted) {
  core::require(x.size() == y.size() && x.size() == error.size() && x.size() == direction.size(),
                "a map needs a place, an error and a direction of each sample");
  std::vector<MapCell> cells(grid.columns * grid.rows);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (direction[i] != wanted || !std::isfinite(x[i]) || !std::isfinite(y[i]) ||
        !std::isfinite(error[i])) {
      continue;
    }
    const std::size_t row = cell_index(y[i], grid.y_from, grid.y_to, grid.rows);
    MapCell& cell =
        cells[row * grid.columns + cell_index(x[i], grid.x_from, grid.x_to, grid.columns)];
    ++cell.samples;
    cell.rmse += error[i] * error[i];
    cell.mean += error[i];
  }
  for (MapCell& cell : cells) {
    if (cell.samples == 0) continue;
    cell.rmse = std::sqrt(cell.rmse / static_cast<double>(cell.samples));
    cell.mean /= static_cast<double>(cell.samples);
  }
  return cells;
}

std::vector<std::int8_t> direction_of_motion(const Timeline& timeline,
                                             std::span<const double> truth) {
  constexpr double kHalfSpanS = 0.05;
  constexpr double kRestSharePerS = 0.002;
  const double rest_speed = kRestSharePerS * range_95(truth);
  std::vector<std::int8_t> direction(truth.size(), 0);
  const auto& t = timeline.t_s;
  for (const IndexRange& stretch : timeline.stretches) {
    std::size_t before = stretch.begin;
    std::size_t after = stretch.begin;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      while (t[i] - t[before] > kHalfSpanS && before + 1 < i) ++before;
      while (after + 1 < stretch.end && t[after] - t[i] < kHalfSpanS) ++after;
      direction[i] = sign_beyond(truth[after] - truth[before], rest_speed * (t[after] - t[before]));
    }
  }
  return direction;
}

std::optional<DetailWindows> detail_windows(const Timeline& timeline, std::span<const double> error,
                                            double duration_s) {
  struct Candidate {
    double rmse;
    IndexRange range;
  };
  std::vector<Candidate> candidates;
  std::optional<IndexRange> worst;
  double peak = -1.0;
  for (const IndexRange& stretch : timeline.stretches) {
    const double start = timeline.t_s[stretch.begin];
    const double length = timeline.t_s[stretch.end - 1] - start;
    if (length < 2 * duration_s) continue;
    for (double middle = duration_s / 2; middle + duration_s / 2 <= length; middle += duration_s) {
      const auto centre = static_cast<std::size_t>(
          std::lower_bound(timeline.t_s.begin(), timeline.t_s.end(), start + middle) -
          timeline.t_s.begin());
      const IndexRange range = window_around(timeline, stretch, centre, duration_s);
      const Summary summary = summary_of(error.subspan(range.begin, range.end - range.begin));
      if (summary.samples == 0) continue;
      candidates.push_back({summary.rmse, range});
    }
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      if (!(std::abs(error[i]) > peak)) continue;
      peak = std::abs(error[i]);
      worst = window_around(timeline, stretch, i, duration_s);
    }
  }
  if (candidates.empty() || !worst) return std::nullopt;
  const auto middle = candidates.begin() + static_cast<std::ptrdiff_t>(candidates.size() / 2);
  std::nth_element(candidates.begin(), middle, candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.rmse < b.rmse; });
  return DetailWindows{middle->range, *worst};
}

}  // namespace ravencal::report
