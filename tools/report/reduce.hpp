// SPDX-License-Identifier: Apache-2.0
//
// From samples to what is drawn: a five-minute recording has more samples than a page has pixels.
// Envelopes keep every peak, histograms count every sample, maps know which cells nobody visited.
// NaN is a missing sample everywhere: never drawn, never counted. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace ravencal::report {

/// A point of a polyline; the line is interrupted where `value` is NaN.
struct Point {
  double t_s = 0.0;
  double value = 0.0;
};

/// Half-open range of sample indices.
struct IndexRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Samples on one rising time axis, and where the axis is not continuous.
struct Timeline {
  std::vector<double> t_s;               ///< never falls; recordings lie end to end
  std::vector<double> recording_starts;  ///< t_s at which the second, third, ... recording starts
  std::vector<IndexRange> stretches;  ///< runs without a time gap, in order, covering all samples
  double period_s = 0.0;              ///< median sampling period; 0 for one sample
};

/// Lays recordings (each begins where t_s falls) end to end and finds gaps: steps of more than
/// 20 periods and 0.1 s.
Timeline timeline_of(std::span<const double> t_s);

/// At most two points per bin of equal duration over the `range` of samples: the least and the
/// greatest value of the bin in order of time. A bin whose samples are all missing interrupts the
/// line, and so does the end of a stretch.
std::vector<Point> envelope(const Timeline& timeline, std::span<const double> values,
                            IndexRange range, std::size_t bins);

struct Histogram {
  double from = 0.0;   ///< lower edge of the first bin
  double width = 1.0;  ///< of every bin
  std::vector<std::uint64_t> counts;
};

/// Counts all finite values in `bins` equal bins of [-half_width, half_width]; values beyond are
/// counted in the outermost bins. half_width > 0, bins >= 1.
Histogram histogram(std::span<const double> values, double half_width, std::size_t bins);

/// `share` of the samples has a magnitude of at most `magnitude`.
struct QuantilePoint {
  double magnitude = 0.0;
  double share = 0.0;
};

/// Quantiles of |value| at `points` shares, evenly spaced, the last one 1 (the peak).
/// points >= 2; empty if no value is finite.
std::vector<QuantilePoint> magnitude_quantiles(std::span<const double> values, std::size_t points);

/// RMS and largest magnitude of the finite values; NaN if there is none.
struct Summary {
  std::uint64_t samples = 0;
  double rmse = 0.0;
  double peak = 0.0;
};
Summary summary_of(std::span<const double> values);

/// Equal cells over a rectangle of the workspace.
struct MapGrid {
  double x_from = 0.0, x_to = 1.0;
  double y_from = 0.0, y_to = 1.0;
  std::size_t columns = 1, rows = 1;
};

/// Smallest grid of `cells` x `cells` that holds all finite points; none if there is no extent.
std::optional<MapGrid> grid_over(std::span<const double> x, std::span<const double> y,
                                 std::size_t cells);

/// The borders of `cells` equal parts, from `from` to `to`.
std::vector<double> edges_of(double from, double to, std::size_t cells);

struct MapCell {
  std::uint64_t samples = 0;  ///< 0: nobody was there, rmse and mean say nothing
  double rmse = 0.0;
  double mean = 0.0;
};

/// Errors by cell, row-major from (x_from, y_from). Only samples with direction[i] == wanted count.
/// All spans have the same length.
std::vector<MapCell> error_map(const MapGrid& grid, std::span<const double> x,
                               std::span<const double> y, std::span<const double> error,
                               std::span<const std::int8_t> direction, std::int8_t wanted);

/// Sign of motion per sample: of the truth's change over +-50 ms where it exceeds 0.2 % of the
/// truth's 95 % range per second, else 0 (at rest).
std::vector<std::int8_t> direction_of_motion(const Timeline& timeline,
                                             std::span<const double> truth);

/// Two windows of `duration_s` to look at closely: the one whose RMS is the median of all, and the
/// one around the largest magnitude. None if no stretch is longer than twice the duration.
struct DetailWindows {
  IndexRange typical;
  IndexRange worst;
};
std::optional<DetailWindows> detail_windows(const Timeline& timeline, std::span<const double> error,
                                            double duration_s);

}  // namespace ravencal::report
