// SPDX-License-Identifier: Apache-2.0
#include "diagnose/simulated.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/effects/nominal.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using record::Recording;

/// Simulators often count from zero: stamps that nowhere overlap count from each start.
std::int64_t shift_of(const Recording& real, const Recording& simulated) {
  const bool overlap =
      simulated.t_ns.front() < real.t_ns.back() && real.t_ns.front() < simulated.t_ns.back();
  return overlap ? 0 : simulated.t_ns.front() - real.t_ns.front();
}

/// The simulation's channels at the recording's times, linear between its rows, NaN beyond them.
core::Result<Recording> aligned(const Recording& real, const Recording& simulated) {
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
  if (covered * 2 >= real.rows()) return out;
  return core::Error{core::ErrorCode::kData,
                     fmt::format("{}: covers {} of {} rows of {}; give a simulation of the same "
                                 "motion, in the order of the recordings",
                                 simulated.source, covered, real.rows(), real.source)};
}

const Series* same_channel(const SeriesSet& set, const Series& series) {
  for (const Series& s : set.series) {
    if (s.joint == series.joint && s.stage == series.stage) return &s;
  }
  return nullptr;
}

void shift_residual(Series& series, const Series& simulated, const physics::Plant& plant) {
  series.y += nominal_of(series, plant).prediction - simulated.y;
  for (Index i = 0; i < series.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool known =
        series.valid[n] != 0 && simulated.valid[n] != 0 && std::isfinite(series.y[i]);
    series.valid[n] = known ? 1 : 0;
    if (!known) series.y[i] = 0.0;
  }
}

}  // namespace

core::Status take_simulation_as_baseline(SeriesSet& set, const std::vector<Recording>& training,
                                         const std::vector<Recording>& held_out,
                                         const std::vector<Recording>& simulated,
                                         const physics::Plant& plant,
                                         const SeriesOptions& options) {
  if (simulated.size() != training.size() + held_out.size()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("--simulated: {} files for {} recordings; give one per "
                                   "recording, held-out recordings last",
                                   simulated.size(), training.size() + held_out.size())};
  }
  std::vector<Recording> first, second;
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    const bool trains = i < training.size();
    const Recording& real = trains ? training[i] : held_out[i - training.size()];
    RAVENCAL_ASSIGN_OR_RETURN(Recording recording, aligned(real, simulated[i]));
    (trains ? first : second).push_back(std::move(recording));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const SeriesSet baseline, build_series(first, second, plant, options));
  std::vector<Series> kept;
  for (Series& series : set.series) {
    // The command stage compares the recording with itself.
    const Series* other =
        series.stage == Stage::kCommand ? nullptr : same_channel(baseline, series);
    if (other == nullptr) {
      set.not_possible.try_emplace(series.joint,
                                   "the simulation lacks the signals that the recording has");
      continue;
    }
    shift_residual(series, *other, plant);
    kept.push_back(std::move(series));
  }
  set.series = std::move(kept);
  if (!set.series.empty()) return {};
  return core::Error{core::ErrorCode::kData,
                     fmt::format("{}: has no joint with the signals of {}",
                                 simulated.front().source, training.front().source)};
}

}  // namespace ravencal::diagnose
