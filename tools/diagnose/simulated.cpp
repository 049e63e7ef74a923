// SPDX-License-Identifier: Apache-2.0
#include "diagnose/simulated.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "diagnose/effects/nominal.hpp"
#include "diagnose/series/input.hpp"
#include "diagnose/simulated_channel.hpp"
#include "diagnose/simulated_command.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;

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

void shift_residual(Series& series, const Series& simulated, const physics::Plant& plant) {
  const VectorXd nominal = nominal_of(series, plant).prediction;
  series.measured_y = series.y;
  // Both efforts through one filter, which each motion would choose for itself.
  const bool effort = series.recorded.size() > 0;
  series.y += nominal - (effort ? series.as_seen(simulated.recorded) : simulated.y);
  if (effort) {
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
    if (effort) series.recorded[i] = series.measured_recorded[i] = 0.0;
  }
}

std::string signals_for(Stage stage) {
  if (stage == Stage::kDrive) return "drive_torque or drive_input, or a position beside it";
  if (stage == Stage::kTracking) return "desired_position or joint_estimate";
  return "joint_truth, or joint_estimate or motor_position beside it";
}

/// Recordings as build_series takes them.
struct Sessions {
  std::vector<Recording> training, held_out;
};

/// The simulations at the recordings' times.
core::Result<Sessions> aligned_sessions(const std::vector<Recording>& training,
                                        const std::vector<Recording>& held_out,
                                        const std::vector<Recording>& simulated,
                                        std::vector<std::string>& notes) {
  if (simulated.size() != training.size() + held_out.size()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("--simulated: {} files for {} recordings; give one per "
                                   "recording, held-out recordings last",
                                   simulated.size(), training.size() + held_out.size())};
  }
  notes = input_notes(simulated, {}, {});
  Sessions out;
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    const bool trains = i < training.size();
    const Recording& real = trains ? training[i] : held_out[i - training.size()];
    RAVENCAL_ASSIGN_OR_RETURN(Recording recording, aligned(real, simulated[i], notes));
    RAVENCAL_RETURN_IF_ERROR(commanded_alike(real, recording));
    (trains ? out.training : out.held_out).push_back(std::move(recording));
  }
  return out;
}

/// What is left of these joints is their motion.
std::vector<Recording> without_efforts(std::vector<Recording> recordings,
                                       const std::set<std::string>& joints) {
  for (Recording& recording : recordings) {
    for (record::Channel& channel : recording.channels) {
      const bool effort =
          channel.role == record::Role::kDriveTorque || channel.role == record::Role::kDriveInput;
      if (effort && joints.contains(channel.joint)) channel.role = record::Role::kFeature;
    }
  }
  return recordings;
}

/// Compares channel by channel and says what of it cannot be compared.
class Comparison {
 public:
  explicit Comparison(const physics::Plant& plant) : plant_(plant) {}

  void compare(SeriesSet& set, const SeriesSet& baseline) {
    for (Series& series : set.series) {
      // The command stage compares the recording with itself.
      if (series.stage != Stage::kCommand) compare(series, same_channel(baseline, series));
    }
  }

  /// The channels that a simulation driven by the recorded efforts leaves: how the joint lags
  /// behind what was asked of it, in both.
  void compare_tracking(SeriesSet& set, const SeriesSet& baseline) {
    for (Series& series : set.series) {
      if (series.stage == Stage::kTracking && driven.contains(series.joint))
        compare(series, same_channel(baseline, series));
    }
  }

  std::vector<Series> kept;
  std::set<std::string> driven;  ///< joints that the recorded effort drives in the simulation
  std::map<std::string, std::string> not_possible;  ///< joint -> why
  std::vector<std::string> notes, reasons;

 private:
  void compare(Series& series, const Series* simulated) {
    if (simulated == nullptr)
      return drop(series, "the simulation lacks " + signals_for(series.stage));
    const Difference difference = difference_of(series, *simulated);
    if (const std::string why = incomparable(series, difference); !why.empty()) {
      if (series.stage == Stage::kDrive && difference.copied()) driven.insert(series.joint);
      return drop(series, why);
    }
    if (!difference.same_motion())
      notes.push_back(
          fmt::format("{}: the simulation has a motion of its own (its {}), and what "
                      "follows from that counts as error",
                      channel_words(series), motion_words(series, difference)));
    shift_residual(series, *simulated, plant_);
    kept.push_back(std::move(series));
  }

  void drop(const Series& series, const std::string& why) {
    std::string& reason = not_possible[series.joint];
    reason += (reason.empty() ? "" : "; ") + why;
    reasons.push_back(fmt::format("{} is not compared: {}", channel_words(series), why));
  }

  const physics::Plant& plant_;
};

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
  Comparison comparison(plant);
  RAVENCAL_ASSIGN_OR_RETURN(const Sessions other,
                            aligned_sessions(training, held_out, simulated, comparison.notes));
  RAVENCAL_ASSIGN_OR_RETURN(const SeriesSet baseline,
                            build_series(other.training, other.held_out, plant, options));
  comparison.compare(set, baseline);
  if (!comparison.driven.empty()) {
    const std::set<std::string>& joints = comparison.driven;
    auto moved = build_series(without_efforts(training, joints), without_efforts(held_out, joints),
                              plant, options);
    const auto simulated_moved =
        build_series(without_efforts(other.training, joints),
                     without_efforts(other.held_out, joints), plant, options);
    // Without a desired position there is no such channel, and the reasons above stand.
    if (moved.ok() && simulated_moved.ok()) comparison.compare_tracking(*moved, *simulated_moved);
  }
  if (comparison.kept.empty()) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: nothing to compare with {}: {}", simulated.front().source,
                                   training.front().source, fmt::join(comparison.reasons, "; "))};
  }
  set.series = std::move(comparison.kept);
  for (const auto& [joint, why] : comparison.not_possible) {
    std::string& reason = set.not_possible[joint];
    reason += (reason.empty() ? "" : "; ") + why;
  }
  for (std::vector<std::string>* more : {&comparison.notes, &comparison.reasons})
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
