// SPDX-License-Identifier: Apache-2.0
#include "rezero/memory.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ravencal::rezero {
namespace {

/// After three lengths a twentieth of what a mean began with is left.
constexpr double kLengths = 3.0;

/// How far a channel went.
struct Way {
  double range = 0.0;   ///< largest minus smallest value
  double length = 0.0;  ///< to and fro
};

Way way_of(const record::Recording& recording, const std::string& channel, Eigen::Index first,
           Eigen::Index row) {
  const auto column = recording.column(channel);
  if (!column) return {};
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  double last = std::nan("");
  Way way;
  for (Eigen::Index i = first; i <= row; ++i) {
    const double value = recording.samples(i, *column);
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    most = std::max(most, value);
    if (std::isfinite(last)) way.length += std::abs(value - last);
    last = value;
  }
  way.range = std::max(most - least, 0.0);
  return way;
}

/// Features start afresh at an episode.
Eigen::Index start_before(const record::Recording& recording, Eigen::Index row) {
  Eigen::Index first = 0;
  for (const record::Event& event : recording.events) {
    if (event.kind != "episode") continue;
    const auto at = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), event.t_ns);
    const Eigen::Index begins = at - recording.t_ns.begin();
    if (begins <= row) first = std::max(first, begins);
  }
  return first;
}

bool is_settled(const model::FeatureSpec& feature, const record::Recording& recording,
                Eigen::Index first, Eigen::Index row) {
  if (feature.transform == model::Transform::kPlay) {
    const Way way = way_of(recording, feature.channel, first, row);
    return way.range >= 2.0 * static_cast<double>(feature.play_half_width);
  }
  if (model::is_travel_mean(feature.transform)) {
    const Way way = way_of(recording, feature.along, first, row);
    return way.length >= kLengths * static_cast<double>(feature.travel_si);
  }
  if (model::is_mean(feature.transform)) {
    const auto since_ns = recording.t_ns[static_cast<std::size_t>(row)] -
                          recording.t_ns[static_cast<std::size_t>(first)];
    return 1e-9 * static_cast<double>(since_ns) >=
           kLengths * static_cast<double>(feature.time_constant_s);
  }
  return true;
}

}  // namespace

std::vector<std::string> unsettled_inputs(const model::CalibrationModel& model,
                                          const record::Recording& recording, Eigen::Index row) {
  const Eigen::Index first = start_before(recording, row);
  std::vector<std::string> inputs;
  for (const model::FeatureSpec& feature : model.features) {
    if (!is_settled(feature, recording, first, row)) inputs.push_back(feature.text());
  }
  return inputs;
}

}  // namespace ravencal::rezero
