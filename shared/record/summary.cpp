// SPDX-License-Identifier: Apache-2.0
#include "record/summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.hpp"

namespace ravencal::record {
namespace {

constexpr std::int64_t kGapFactor = 3;

ChannelSummary summarise_channel(const Recording& recording, Eigen::Index column) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ChannelSummary summary;
  summary.channel = recording.channels[static_cast<std::size_t>(column)];
  summary.min = kInfinity;
  summary.max = -kInfinity;
  for (const double value : recording.samples.col(column)) {
    if (std::isnan(value)) {
      ++summary.lost;
      continue;
    }
    summary.min = std::min(summary.min, value);
    summary.max = std::max(summary.max, value);
  }
  if (summary.min > summary.max)
    summary.min = summary.max = std::numeric_limits<double>::quiet_NaN();
  return summary;
}

JointErrorSummary summarise_joint(const Recording& recording, const std::string& joint) {
  const Eigen::Index truth = *recording.column(Role::kJointTruth, joint);
  const Eigen::Index estimate = *recording.column(Role::kJointEstimate, joint);
  JointErrorSummary summary;
  summary.joint = joint;
  summary.unit = recording.channels[static_cast<std::size_t>(truth)].unit;
  double sum = 0.0;
  double squares = 0.0;
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const double error = recording.samples(row, truth) - recording.samples(row, estimate);
    if (std::isnan(error)) continue;
    ++summary.samples;
    sum += error;
    squares += error * error;
    summary.peak = std::max(summary.peak, std::abs(error));
  }
  const auto count = static_cast<double>(std::max<std::size_t>(summary.samples, 1));
  summary.bias = sum / count;
  summary.rmse = std::sqrt(squares / count);
  return summary;
}

void summarise_time(const std::vector<std::int64_t>& t_ns, Summary& summary) {
  if (t_ns.size() < 2) return;
  std::vector<std::int64_t> steps(t_ns.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = t_ns[i + 1] - t_ns[i];
  summary.duration_s = static_cast<double>(t_ns.back() - t_ns.front()) * 1e-9;
  const std::int64_t median_ns = core::upper_median(steps);
  if (median_ns <= 0) return;
  summary.rate_hz = 1e9 / static_cast<double>(median_ns);
  const std::int64_t limit_ns = kGapFactor * median_ns;
  for (const std::int64_t step : steps) {
    if (step <= limit_ns) continue;
    ++summary.gaps;
    summary.longest_gap_s = std::max(summary.longest_gap_s, static_cast<double>(step) * 1e-9);
  }
}

}  // namespace

Summary summarise(const Recording& recording) {
  Summary summary;
  summary.rows = static_cast<std::size_t>(recording.rows());
  summarise_time(recording.t_ns, summary);
  for (Eigen::Index c = 0; c < recording.samples.cols(); ++c) {
    summary.channels.push_back(summarise_channel(recording, c));
  }
  for (const std::string& joint : recording.calibratable_joints()) {
    summary.joints.push_back(summarise_joint(recording, joint));
  }
  summary.implausible = implausibilities(recording);
  return summary;
}

}  // namespace ravencal::record
