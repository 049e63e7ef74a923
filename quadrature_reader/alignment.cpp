// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "quadrature_reader/interpolate.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr double kLargestResidualNs = 1e6;

struct Columns {
  std::vector<std::string> joints;
  std::vector<Eigen::Index> robot;
  std::vector<Eigen::Index> truth;
};

core::Result<Columns> matching_columns(const record::Recording& robot,
                                       const record::Recording& truth) {
  Columns columns;
  for (const auto& channel : truth.channels) {
    if (channel.role != record::Role::kJointTruth) continue;
    const auto estimate = robot.column(record::Role::kJointEstimate, channel.joint);
    if (!estimate) continue;
    columns.joints.push_back(channel.joint);
    columns.robot.push_back(*estimate);
    columns.truth.push_back(*truth.column(record::Role::kJointTruth, channel.joint));
  }
  if (!columns.joints.empty()) return columns;
  return core::Error{
      core::ErrorCode::kData,
      fmt::format("{} and {} have no joint in common: one needs its joint_estimate, the other its "
                  "joint_truth",
                  robot.source, truth.source)};
}

Track track_of(std::span<const std::int64_t> t_ns, const record::SampleMatrix& samples,
               std::span<const Eigen::Index> columns) {
  Track track{t_ns, {}};
  for (const Eigen::Index column : columns) track.position.emplace_back(samples.col(column));
  return track;
}

/// Adds one truth channel, interpolated at the robot's times, to `merged`.
void add_truth(record::Recording& merged, const record::Channel& channel, Interpolator series,
               double delay_ns) {
  const Eigen::Index column = merged.samples.cols();
  merged.samples.conservativeResize(Eigen::NoChange, column + 1);
  for (Eigen::Index row = 0; row < merged.samples.rows(); ++row) {
    merged.samples(row, column) = series.at(merged.t_ns[static_cast<std::size_t>(row)], delay_ns);
  }
  merged.channels.push_back(channel);
}

void drop_truth_channels(record::Recording& recording) {
  Eigen::Index kept = 0;
  std::vector<record::Channel> channels;
  for (std::size_t i = 0; i < recording.channels.size(); ++i) {
    if (recording.channels[i].role == record::Role::kJointTruth) continue;
    recording.samples.col(kept++) = recording.samples.col(static_cast<Eigen::Index>(i)).eval();
    channels.push_back(recording.channels[i]);
  }
  recording.samples.conservativeResize(Eigen::NoChange, kept);
  recording.channels = std::move(channels);
}

}  // namespace

std::int64_t ClockRelation::realtime_of(std::int64_t monotonic_ns) const {
  const double since_ns = static_cast<double>(monotonic_ns - reference_ns);
  return monotonic_ns + offset_ns + std::llround(1e-6 * drift_ppm * since_ns);
}

core::Result<ClockRelation> clock_relation(const record::Recording& recording) {
  std::vector<std::pair<std::int64_t, std::int64_t>> points;
  for (const auto& event : recording.events) {
    if (event.kind != "clock_offset") continue;
    const auto detail = nlohmann::json::parse(event.detail, nullptr, false);
    if (!detail.is_object() || !detail.contains("minus_monotonic_ns") ||
        !detail["minus_monotonic_ns"].is_number_integer()) {
      continue;
    }
    points.emplace_back(event.t_ns, detail["minus_monotonic_ns"].get<std::int64_t>());
  }
  if (points.empty()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: has no clock_offset events; was it written by ravencal-encoders?",
                    recording.source)};
  }
  ClockRelation relation;
  relation.reference_ns = points.front().first;
  relation.offset_ns = points.front().second;
  // Least squares line, relative to the first point so that doubles suffice.
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (const auto& [t, offset] : points) {
    const auto x = static_cast<double>(t - relation.reference_ns);
    const auto y = static_cast<double>(offset - relation.offset_ns);
    n += 1.0, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const double spread = n * sxx - sx * sx;
  const double slope = spread > 0.0 ? (n * sxy - sx * sy) / spread : 0.0;
  relation.drift_ppm = 1e6 * slope;
  relation.offset_ns += std::llround((sy - slope * sx) / n);
  for (const auto& [t, offset] : points) {
    const auto error = static_cast<double>(t + offset - relation.realtime_of(t));
    relation.residual_ns = std::max(relation.residual_ns, std::abs(error));
  }
  if (relation.residual_ns <= kLargestResidualNs) return relation;
  return core::Error{
      core::ErrorCode::kData,
      fmt::format(
          "{}: the wall clock was stepped by about {:.1f} ms during the recording; its relation "
          "to the robot's stamps is unknown",
          recording.source, 1e-6 * relation.residual_ns)};
}

core::Result<Merged> merge_truth(const record::Recording& robot, const record::Recording& truth,
                                 const MergeOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(const Columns columns, matching_columns(robot, truth));
  Merged merged;
  std::vector<std::int64_t> truth_t_ns(truth.t_ns);
  if (options.robot_uses_realtime) {
    RAVENCAL_ASSIGN_OR_RETURN(merged.clock, clock_relation(truth));
    for (auto& t : truth_t_ns) t = merged.clock->realtime_of(t);
  }
  for (auto& t : truth_t_ns) t -= options.truth_minus_robot_ns;
  if (robot.t_ns.empty() || truth_t_ns.empty() || robot.t_ns.back() < truth_t_ns.front() ||
      truth_t_ns.back() < robot.t_ns.front()) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{} and {} do not overlap in time; do they use the same clock?",
                                   robot.source, truth.source)};
  }
  if (options.fixed_delay_s) {
    merged.delay.delay_s = *options.fixed_delay_s;
  } else {
    RAVENCAL_ASSIGN_OR_RETURN(merged.delay,
                              estimate_delay(track_of(robot.t_ns, robot.samples, columns.robot),
                                             track_of(truth_t_ns, truth.samples, columns.truth),
                                             columns.joints, options.delay));
  }
  merged.recording = robot;
  drop_truth_channels(merged.recording);
  for (const Eigen::Index column : columns.truth) {
    const std::span<const double> values(truth.samples.col(column).data(), truth_t_ns.size());
    add_truth(merged.recording, truth.channels[static_cast<std::size_t>(column)],
              Interpolator(truth_t_ns, values, options.longest_gap_ns), 1e9 * merged.delay.delay_s);
  }
  const auto added = static_cast<Eigen::Index>(columns.truth.size());
  for (Eigen::Index row = 0; row < merged.recording.rows(); ++row) {
    merged.rows_with_truth +=
        merged.recording.samples.row(row).tail(added).array().isFinite().all() ? 1 : 0;
  }
  merged.recording.events.insert(
      merged.recording.events.begin(),
      {robot.t_ns.front(), "merge",
       fmt::format(
           R"({{"truth":"{}","delay_s":{:.6f},"sigma_s":{:.6f},"correlation":{:.4f},"rows_with_truth":{}}})",
           truth.source, merged.delay.delay_s, merged.delay.sigma_s, merged.delay.correlation,
           merged.rows_with_truth)});
  return merged;
}

}  // namespace ravencal::quadrature_reader
