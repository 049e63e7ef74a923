// SPDX-License-Identifier: Apache-2.0
//
// The report: one HTML page that opens offline and shows what a calibration does to the joints.
// The caller fills CalibrationReport and calls write_html(); every part but the title is optional,
// and what is absent is left out of the page. Not for real-time code; no shared state, so any
// thread may call.
// Units: joint values in display units (deg or mm, named by `unit`), times in s, durations in ns.
// An error is always estimate - truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"

namespace ravencal::report {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Root mean square and largest magnitude of an error. A figure that is not known is kUnknown and
/// is shown as a dash.
struct ErrorFigure {
  double rmse = kUnknown;
  double peak = kUnknown;
};

/// One joint's line in an ErrorTable. The page computes the reductions in % itself.
struct ErrorRow {
  std::string joint;  ///< e.g. "elbow"
  std::string unit;   ///< "deg" or "mm"
  std::uint64_t samples = 0;
  ErrorFigure raw;                       ///< of the uncorrected estimate
  ErrorFigure bias_removed;              ///< after the training mean of the error is taken off
  ErrorFigure calibrated;                ///< of the corrected estimate
  std::optional<ErrorFigure> published;  ///< somebody else's calibrated figure, to compare with
};

struct ErrorTable {
  std::string title;  ///< e.g. "held-out recordings"
  std::string note;   ///< shown below the table; may be empty
  std::string
      published_label;  ///< source of the `published` figures, e.g. "arXiv 2302.04999, table II"
  std::vector<ErrorRow> rows;
};

/// One joint over time. All vectors but the optional ones have the same length, >= 1. NaN in
/// truth, raw or corrected is a gap: not drawn and not counted.
struct JointSeries {
  std::string joint;
  std::string unit;         ///< "deg" or "mm"
  std::vector<double> t_s;  ///< within a recording rising; a fall starts the next recording,
                            ///< which is drawn behind the one before
  std::vector<double> truth;
  std::vector<double> raw;
  std::vector<double> corrected;
  double bias = 0.0;  ///< bias removed = raw - bias: the mean of raw - truth in TRAINING
  std::vector<std::int8_t> velocity_sign;  ///< -1, 0, +1 per sample; empty: taken from the truth
};

/// Loss of one training run, one element per epoch.
struct LossCurve {
  std::string name;  ///< e.g. "seed 1"
  std::vector<double> train;
  std::vector<double> validation;         ///< empty, or as long as train
  std::optional<std::size_t> kept_epoch;  ///< 1-based epoch whose weights were kept
};

/// Percentiles of a duration.
struct DurationFigures {
  double p50_ns = kUnknown;
  double p99_ns = kUnknown;
  double p999_ns = kUnknown;
  double max_ns = kUnknown;
};

/// Samples with from_ns <= duration < to_ns. Bins may be of any width.
struct DurationBin {
  double from_ns = 0.0;
  double to_ns = 0.0;
  std::uint64_t count = 0;
};

/// What a host measured while it ran the plugin.
struct RealTimeFigures {
  double rate_hz = 1000.0;
  std::uint64_t ticks = 0;
  bool realtime = false;      ///< ran with a real-time scheduling class
  std::string conditions;     ///< machine, kernel, load: one sentence
  DurationFigures wakeup_ns;  ///< lateness of the wake-up
  DurationFigures step_ns;    ///< time inside the plugin's step
  std::vector<DurationBin> wakeup_histogram;
  std::vector<DurationBin> step_histogram;
};

struct CalibrationReport {
  std::string title;     ///< e.g. "Calibration of the left arm"
  std::string subtitle;  ///< e.g. recordings and date; may be empty
  std::string verdict;   ///< one or two plain sentences, first thing on the page
  std::vector<std::pair<std::string, std::string>> provenance;  ///< shown in this order
  std::string reproduce;  ///< the shell commands that make this page again; may be empty
  std::vector<ErrorTable> tables;
  std::vector<JointSeries> series;
  /// Joints whose truth spans the error maps, by name, horizontal and vertical; both must be in
  /// `series`, and every series must then be of equal length. Empty names: no maps.
  std::string map_x_joint;
  std::string map_y_joint;
  std::vector<LossCurve> losses;
  std::string loss_unit = "mean squared error, scaled outputs";
  std::optional<RealTimeFigures> real_time;
};

/// Writes the page to `path`. Errors: kUsage if vectors disagree in length or a map joint is
/// missing, kIo if the file cannot be written; then `path` is as it was.
core::Status write_html(const CalibrationReport& report, const std::filesystem::path& path);

}  // namespace ravencal::report
