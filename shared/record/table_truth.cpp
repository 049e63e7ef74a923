// SPDX-License-Identifier: Apache-2.0
#include "record/table_truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ravencal::record {

std::vector<std::size_t> episode_bounds(std::span<const char> episode_start) {
  std::vector<std::size_t> bounds = {0};
  for (std::size_t row = 1; row < episode_start.size(); ++row) {
    if (episode_start[row]) bounds.push_back(row);
  }
  bounds.push_back(episode_start.size());
  return bounds;
}

void reference_truth(Recording& recording, std::span<const char> episode_start) {
  const std::vector<std::size_t> bounds = episode_bounds(episode_start);
  for (const std::string& joint : recording.calibratable_joints()) {
    const auto truth = *recording.column(Role::kJointTruth, joint);
    const auto estimate = *recording.column(Role::kJointEstimate, joint);
    for (std::size_t e = 0; e + 1 < bounds.size(); ++e) {
      const auto first = static_cast<Eigen::Index>(bounds[e]);
      const auto count = static_cast<Eigen::Index>(bounds[e + 1]) - first;
      auto true_values = recording.samples.col(truth).segment(first, count);
      const auto believed = recording.samples.col(estimate).segment(first, count);
      for (Eigen::Index i = 0; i < count; ++i) {
        const double difference = true_values(i) - believed(i);
        if (std::isnan(difference)) continue;
        true_values.array() -= difference;
        break;
      }
    }
  }
}

void blank_early_truth(Recording& recording, double from_s) {
  if (!(from_s > 0.0)) return;
  const std::int64_t from_ns = recording.t_ns.front() + std::llround(from_s * kNsPerS);
  const auto first = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), from_ns);
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    if (recording.channels[c].role != Role::kJointTruth) continue;
    recording.samples.col(static_cast<Eigen::Index>(c))
        .head(first - recording.t_ns.begin())
        .setConstant(std::numeric_limits<double>::quiet_NaN());
  }
}

}  // namespace ravencal::record
