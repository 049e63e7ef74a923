// SPDX-License-Identifier: Apache-2.0
#include "diagnose/simulated.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/units.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose/series/input.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;

/// A signal that is nearer to the measured one than this share of it was copied from it. Source:
/// converters of drives have 12 bits or a little more and resolve a few thousandths of a usual
/// effort, so that nothing computed comes nearer to what they measured.
constexpr double kCopied = 1e-3;

/// Share of the motion's variance that a simulation may miss and still be compared row by row.
/// Source: a simulation is satisfactory from an efficiency (1 - this share) of 0.5 on (Moriasi et
/// al. 2007, Transactions of the ASABE 50, 885-900; the efficiency is Nash's and Sutcliffe's).
constexpr double kMostMotionMissed = 0.5;

/// Simulators often count from zero: stamps that nowhere overlap count from each start.
std::int64_t shift_of(const Recording& real, const Recording& simulated) {
  const bool overlap =
      simulated.t_ns.front() < real.t_ns.back() && real.t_ns.front() < simulated.t_ns.back();
  return overlap ? 0 : simulated.t_ns.front() - real.t_ns.front();
}

/// The simulation's channels at the recording's times, linear between its rows, NaN beyond them.
core::Result<Recording> aligned(const Recording& real, const Recording& simulated,
                                std::vector<std::string>& notes) {
  if (simulated.rows() < 2 || real.rows() < 1) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: too few rows to stand for {}",
                                                           simulated.source, real.source)};
  }
  Recording out;
  out.channels = simulated.channels;
  out.events = real.events;
  out.t_ns = real.t_ns;
  out.source = simulated.source;
  out.samples.setConstant(real.rows(), simulated.samples.cols(),
                          std::numeric_limits<double>::quiet_NaN());
  const std::int64_t shift = shift_of(real, simulated);
  if (shift != 0)
    notes.push_back(
        fmt::format("the times of {} and {} nowhere overlap, so that each counts from "
                    "its own start",
                    file_name(simulated), file_name(real)));
  std::size_t after = 1;
  Index covered = 0;
  for (Index i = 0; i < real.rows(); ++i) {
    const std::int64_t t = real.t_ns[static_cast<std::size_t>(i)] + shift;
    while (after + 1 < simulated.t_ns.size() && simulated.t_ns[after] < t) ++after;
    const std::int64_t t0 = simulated.t_ns[after - 1];
    const std::int64_t t1 = simulated.t_ns[after];
    if (t < t0 || t > t1) continue;
    const double share = t1 > t0 ? static_cast<double>(t - t0) / static_cast<double>(t1 - t0) : 0.0;
    const auto row = static_cast<Index>(after);
    out.samples.row(i) =
        (1.0 - share) * simulated.samples.row(row - 1) + share * simulated.samples.row(row);
    ++covered;
  }
  const std::string covers =
      fmt::format("covers {} of {} rows of {}", covered, real.rows(), real.source);
  if (covered * 2 < real.rows()) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: {}; give a simulation of the same motion or command, in "
                                   "the order of the recordings",
                                   simulated.source, covers)};
  }
  if (covered < real.rows())
    notes.push_back(
        fmt::format("{} {}; the others are not looked at", file_name(simulated), covers));
  return out;
}

const Series* same_channel(const SeriesSet& set, const Series& series) {
  for (const Series& s : set.series) {
    if (s.joint == series.joint && s.stage == series.stage) return &s;
  }
  return nullptr;
}

std::string channel_words(const Series& series) {
  return fmt::format("joint {} ({})", series.joint, stage_word(series.stage));
}

/// What a channel's residual follows first: friction and inertia the speed, cables the position.
const VectorXd& followed_motion(const Series& series) {
  return series.stage == Stage::kDrive ? series.motion.v : series.motion.q;
}

/// Of values one after the other (Welford, 1962).
class Spread {
 public:
  void add(double x) {
    count_ += 1.0;
    const double from_mean = x - mean_;
    mean_ += from_mean / count_;
    squares_ += from_mean * (x - mean_);
  }
  [[nodiscard]] double deviation() const { return std::sqrt(squares_ / std::max(1.0, count_)); }

 private:
  double count_ = 0.0, mean_ = 0.0, squares_ = 0.0;
};

/// How a simulation's channel differs from the recorded one, over rows that both have.
struct Difference {
  double measured = 0.0;  ///< deviation of the recorded signal
  double signal = 0.0;    ///< RMS of recording minus simulation
  double moved = 0.0;     ///< deviation of the recorded motion
  double motion = 0.0;    ///< deviation of recorded minus simulated motion
  Index rows = 0;

  [[nodiscard]] bool copied() const { return signal <= kCopied * measured; }
  [[nodiscard]] bool same_motion() const { return motion <= kCopied * moved; }
  /// Of the motion's variance.
  [[nodiscard]] double missed() const {
    return moved > 0.0 ? motion * motion / (moved * moved) : 0.0;
  }
};

Difference difference_of(const Series& real, const Series& simulated) {
  const VectorXd& a = followed_motion(real);
  const VectorXd& b = followed_motion(simulated);
  double signal = 0.0;
  Spread measured, moved, apart;
  Difference out;
  for (Index i = 0; i < real.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (real.valid[n] == 0 || simulated.valid[n] == 0) continue;
    ++out.rows;
    signal += std::pow(real.y[i] - simulated.y[i], 2);
    measured.add(real.y[i]);
    moved.add(a[i]);
    apart.add(a[i] - b[i]);
  }
  out.signal = std::sqrt(signal / static_cast<double>(std::max<Index>(1, out.rows)));
  out.measured = measured.deviation();
  out.moved = moved.deviation();
  out.motion = apart.deviation();
  return out;
}

/// "0.12 deg of 3.4 deg", with the unit of what the channel follows.
std::string motion_words(const Series& series, const Difference& d) {
  const core::DisplayUnit unit = core::display_unit(series.prismatic ? "m" : "rad");
  const bool speed = series.stage == Stage::kDrive;
  return fmt::format("{} differs by {:.3g} of {:.3g} {}{} RMS", speed ? "speed" : "position",
                     d.motion * unit.per_si, d.moved * unit.per_si, unit.name, speed ? "/s" : "");
}

/// Why the channel cannot be compared with its simulation; empty if it can.
std::string incomparable(const Series& series, const Difference& d) {
  const bool drive = series.stage == Stage::kDrive;
  if (d.rows == 0) return "the simulation has no row in common with the recording";
  if (d.copied()) {
    return fmt::format(
        "the simulation has the recorded {} ({:.2g} of it differs), so that nothing is left to "
        "compare; {}",
        drive ? "effort" : "error", d.measured > 0.0 ? d.signal / d.measured : 0.0,
        drive ? "give an inverse simulation, which computes the effort of the recorded motion, or "
                "leave --simulated out"
              : "give a simulation that computes the joint from the motor");
  }
  if (d.missed() > kMostMotionMissed) {
    return fmt::format(
        "the simulation moves too differently to be compared row by row: its {}, {:.0f} % of the "
        "variance, and {:.0f} % is the most; give an inverse simulation, or start the simulation "
        "anew from the recorded state more often",
        motion_words(series, d), 100.0 * d.missed(), 100.0 * kMostMotionMissed);
  }
  return {};
}

void shift_residual(Series& series, const Series& simulated, const physics::Plant& plant) {
  const VectorXd nominal = nominal_of(series, plant).prediction;
  series.measured_y = series.y;
  series.y += nominal - simulated.y;
  if (series.recorded.size() > 0) {
    series.measured_recorded = series.recorded;
    series.recorded += nominal - simulated.recorded;
  }
  for (Index i = 0; i < series.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool known =
        series.valid[n] != 0 && simulated.valid[n] != 0 && std::isfinite(series.y[i]);
    series.valid[n] = known ? 1 : 0;
    if (known) continue;
    series.y[i] = series.measured_y[i] = 0.0;
    if (series.recorded.size() > 0) series.recorded[i] = series.measured_recorded[i] = 0.0;
  }
}

std::string signals_for(Stage stage) {
  if (stage == Stage::kDrive) return "drive_torque or drive_input, or a position beside it";
  if (stage == Stage::kTracking) return "desired_position or joint_estimate";
  return "joint_truth, or joint_estimate or motor_position beside it";
}

void drop(const Series& series, const std::string& why, SeriesSet& set,
          std::vector<std::string>& reasons) {
  std::string& reason = set.not_possible[series.joint];
  reason += (reason.empty() ? "" : "; ") + why;
  reasons.push_back(fmt::format("{} is not compared: {}", channel_words(series), why));
}

core::Result<SeriesSet> baseline_of(const std::vector<Recording>& training,
                                    const std::vector<Recording>& held_out,
                                    const std::vector<Recording>& simulated,
                                    const physics::Plant& plant, const SeriesOptions& options,
                                    std::vector<std::string>& notes) {
  if (simulated.size() != training.size() + held_out.size()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("--simulated: {} files for {} recordings; give one per "
                                   "recording, held-out recordings last",
                                   simulated.size(), training.size() + held_out.size())};
  }
  for (std::string& note : input_notes(simulated, {}, {})) notes.push_back(std::move(note));
  std::vector<Recording> first, second;
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    const bool trains = i < training.size();
    const Recording& real = trains ? training[i] : held_out[i - training.size()];
    RAVENCAL_ASSIGN_OR_RETURN(Recording recording, aligned(real, simulated[i], notes));
    (trains ? first : second).push_back(std::move(recording));
  }
  return build_series(first, second, plant, options);
}

/// RMS over the rows that figures are on: held-out ones or, without any, those that fits see.
double rms_of_figures(const Series& series, const VectorXd& x) {
  if (!series.any_held_out()) return series.training_rms(x);
  double sum = 0.0, count = 0.0;
  for (Index i = 0; i < series.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (series.held_out[n] == 0 || series.valid[n] == 0) continue;
    sum += x[i] * x[i];
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

void scale_figure(Report& report, const std::string& joint, std::string_view metric, double factor,
                  double floor_factor) {
  for (HeldOut& figure : report.held_out) {
    if (figure.joint != joint || figure.metric != metric) continue;
    figure.before *= factor;
    figure.after *= factor;
    figure.floor *= floor_factor;
  }
}

/// Shares of `shifted` as shares of `measured`; 0: nothing was measured.
double factor_of(const Series& series, const VectorXd& shifted, const VectorXd& measured) {
  const double whole = rms_of_figures(series, measured);
  return whole > 0.0 ? rms_of_figures(series, shifted) / whole : 0.0;
}

/// Traces hold y, whose shift at their times goes off all three lines.
void unshift_traces(const Series& series, ChannelPlot& plot) {
  for (Trace& trace : plot.traces) {
    Index row = 0;
    for (std::size_t k = 0; k < trace.t_s.size(); ++k) {
      if (std::isnan(trace.t_s[k])) continue;
      const auto here = [&](Index i) {
        const auto n = static_cast<std::size_t>(i);
        return static_cast<std::size_t>(series.recording[n]) == trace.recording &&
               series.t_s[i] == trace.t_s[k];
      };
      while (row < series.rows() && !here(row)) ++row;
      if (row == series.rows()) break;
      const double shift = series.y[row] - series.measured_y[row];
      for (auto* line : {&trace.measured, &trace.nominal, &trace.refitted}) (*line)[k] -= shift;
    }
  }
}

}  // namespace

core::Status take_simulation_as_baseline(SeriesSet& set, const std::vector<Recording>& training,
                                         const std::vector<Recording>& held_out,
                                         const std::vector<Recording>& simulated,
                                         const physics::Plant& plant,
                                         const SeriesOptions& options) {
  std::vector<std::string> notes, reasons;
  RAVENCAL_ASSIGN_OR_RETURN(const SeriesSet baseline,
                            baseline_of(training, held_out, simulated, plant, options, notes));
  std::vector<Series> kept;
  for (Series& series : set.series) {
    // The command stage compares the recording with itself.
    if (series.stage == Stage::kCommand) continue;
    const Series* other = same_channel(baseline, series);
    if (other == nullptr) {
      drop(series, "the simulation lacks " + signals_for(series.stage), set, reasons);
      continue;
    }
    const Difference difference = difference_of(series, *other);
    if (const std::string why = incomparable(series, difference); !why.empty()) {
      drop(series, why, set, reasons);
      continue;
    }
    if (!difference.same_motion())
      notes.push_back(
          fmt::format("{}: the simulation has a motion of its own (its {}), and what "
                      "follows from that counts as error",
                      channel_words(series), motion_words(series, difference)));
    shift_residual(series, *other, plant);
    kept.push_back(std::move(series));
  }
  set.series = std::move(kept);
  if (set.series.empty()) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: nothing to compare with {}: {}", simulated.front().source,
                                   training.front().source, fmt::join(reasons, "; "))};
  }
  for (std::vector<std::string>* more : {&notes, &reasons})
    std::move(more->begin(), more->end(), std::back_inserter(set.notes));
  return {};
}

void refer_to_measured(const SeriesSet& set, Report& report) {
  for (const Series& series : set.series) {
    if (series.measured_y.size() == 0) continue;
    if (series.stage == Stage::kDrive) {
      const double filtered = factor_of(series, series.y, series.measured_y);
      scale_figure(report, series.joint, "effort_relative_error", filtered, filtered);
      scale_figure(report, series.joint, "effort_relative_error_unfiltered",
                   factor_of(series, series.recorded, series.measured_recorded), filtered);
    }
    for (ChannelPlot& plot : report.plots) {
      if (plot.joint == series.joint && plot.stage == stage_word(series.stage))
        unshift_traces(series, plot);
    }
  }
}

}  // namespace ravencal::diagnose
