// SPDX-License-Identifier: Apache-2.0
#include "record/alignment.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "record/interpolate.hpp"
#include "record/name_list.hpp"
#include "record/plausibility.hpp"
#include "record/wall_origin.hpp"

namespace ravencal::record {
namespace {

struct Columns {
  std::vector<std::string> joints;
  std::vector<Eigen::Index> robot;
  std::vector<Eigen::Index> truth;
};

core::Result<Columns> matching_columns(const Recording& robot, const Recording& truth) {
  Columns columns;
  for (const auto& channel : truth.channels) {
    if (channel.role != Role::kJointTruth) continue;
    const auto estimate = robot.column(Role::kJointEstimate, channel.joint);
    if (!estimate) continue;
    columns.joints.push_back(channel.joint);
    columns.robot.push_back(*estimate);
    columns.truth.push_back(*truth.column(Role::kJointTruth, channel.joint));
  }
  const auto is_known = [&](Eigen::Index column) {
    return truth.samples.col(column).array().isFinite().any();
  };
  if (std::any_of(columns.truth.begin(), columns.truth.end(), is_known)) return columns;
  if (!columns.joints.empty()) {
    return core::data_error(
        fmt::format("{}: no row has the truth of {}: the encoders' zeros were not found; record "
                    "with `ravencal-encoders --home` while the robot homes",
                    truth.source, fmt::join(columns.joints, ", ")));
  }
  return core::Error{
      core::ErrorCode::kData,
      fmt::format("{} and {} have no joint in common: one needs its joint_estimate, the other its "
                  "joint_truth",
                  robot.source, truth.source)};
}

Track track_of(std::span<const std::int64_t> t_ns, const SampleMatrix& samples,
               std::span<const Eigen::Index> columns) {
  Track track{t_ns, {}};
  for (const Eigen::Index column : columns) track.position.emplace_back(samples.col(column));
  return track;
}

bool overlap(std::span<const std::int64_t> x, std::span<const std::int64_t> y) {
  return !x.empty() && !y.empty() && x.front() <= y.back() && y.front() <= x.back();
}

bool has_clock_events(const Recording& recording) {
  return std::any_of(recording.events.begin(), recording.events.end(),
                     [](const auto& event) { return event.kind == "clock_offset"; });
}

/// The truth's times on the robot's clock.
struct TruthTime {
  std::optional<ClockRelation> clock;
  std::int64_t shift_ns = 0;

  [[nodiscard]] std::int64_t on_robot_clock(std::int64_t t_ns) const {
    return (clock ? clock->realtime_of(t_ns) : t_ns) - shift_ns;
  }
  [[nodiscard]] std::vector<std::int64_t> on_robot_clock(std::span<const std::int64_t> t_ns) const {
    std::vector<std::int64_t> converted;
    converted.reserve(t_ns.size());
    for (const std::int64_t t : t_ns) converted.push_back(on_robot_clock(t));
    return converted;
  }
};

core::Result<TruthTime> relate_clocks(const Recording& robot, const Recording& truth,
                                      const MergeOptions& options) {
  const TruthTime same{std::nullopt, options.truth_minus_robot_ns};
  const bool same_fits = overlap(robot.t_ns, same.on_robot_clock(truth.t_ns));
  TruthTime wall{std::nullopt, options.truth_minus_robot_ns + wall_origin_ns(robot)};
  bool wall_fits = false;
  if (options.clock != RobotClock::kSame) {
    auto relation = clock_relation(truth);
    if (relation.ok()) {
      wall.clock = *relation;
      wall_fits = overlap(robot.t_ns, wall.on_robot_clock(truth.t_ns));
    } else if (options.clock == RobotClock::kWall || (!same_fits && has_clock_events(truth))) {
      return relation.error();
    }
  }
  if (same_fits && wall_fits) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("{} and {} overlap both as they are stamped and through the wall "
                    "clock; say which clock stamped the robot's states",
                    robot.source, truth.source)};
  }
  if (wall_fits) return wall;
  if (same_fits && options.clock != RobotClock::kWall) return same;
  return core::Error{core::ErrorCode::kData,
                     fmt::format("{} and {} do not overlap in time; do they belong together?",
                                 robot.source, truth.source)};
}

/// Adds one truth channel, interpolated at the robot's times, to `merged`; rows that have it.
std::int64_t add_truth(Recording& merged, Channel channel, Interpolator series, double delay_ns) {
  const Eigen::Index column = merged.samples.cols();
  merged.samples.conservativeResize(Eigen::NoChange, column + 1);
  for (Eigen::Index row = 0; row < merged.samples.rows(); ++row) {
    merged.samples(row, column) = series.at(merged.t_ns[static_cast<std::size_t>(row)], delay_ns);
  }
  channel.name = "truth." + channel.joint;
  merged.channels.push_back(std::move(channel));
  return merged.samples.col(column).array().isFinite().count();
}

void drop_truth_channels(Recording& recording) {
  Eigen::Index kept = 0;
  std::vector<Channel> channels;
  for (std::size_t i = 0; i < recording.channels.size(); ++i) {
    if (recording.channels[i].role == Role::kJointTruth) continue;
    recording.samples.col(kept++) = recording.samples.col(static_cast<Eigen::Index>(i)).eval();
    channels.push_back(recording.channels[i]);
  }
  recording.samples.conservativeResize(Eigen::NoChange, kept);
  recording.channels = std::move(channels);
}

/// An event of the truth's recording at the robot's time, `from_ns` and `to_ns` in it too.
Event on_robot_clock(const Event& event, const TruthTime& time, std::int64_t delay_ns) {
  Event moved = event;
  moved.t_ns = time.on_robot_clock(event.t_ns) - delay_ns;
  auto detail = nlohmann::ordered_json::parse(event.detail, nullptr, false);
  if (!detail.is_object()) return moved;
  for (const char* key : {"from_ns", "to_ns"}) {
    if (!detail.contains(key) || !detail[key].is_number_integer()) continue;
    detail[key] = time.on_robot_clock(detail[key].get<std::int64_t>()) - delay_ns;
  }
  moved.detail = detail.dump();
  return moved;
}

void add_events(Merged& merged, const Recording& truth, const TruthTime& time) {
  auto& events = merged.recording.events;
  const std::int64_t delay_ns = std::llround(1e9 * merged.delay_s);
  for (const auto& event : truth.events) {
    if (event.kind != "clock_offset") events.push_back(on_robot_clock(event, time, delay_ns));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& x, const auto& y) { return x.t_ns < y.t_ns; });
}

/// What was assumed of the truth's channels stays an assumption.
void keep_assumptions(Merged& merged, const Recording& truth) {
  const auto of_truth = truth.meta.find("assumed_channels");
  if (of_truth == truth.meta.end()) return;
  std::string& assumed = merged.recording.meta["assumed_channels"];
  for (const Channel& channel : truth.channels) {
    const auto column = merged.recording.column(Role::kJointTruth, channel.joint);
    if (channel.role != Role::kJointTruth || !column || !is_listed(of_truth->second, channel.name))
      continue;
    add_to_list(assumed, merged.recording.channels[static_cast<std::size_t>(*column)].name);
  }
  if (assumed.empty()) merged.recording.meta.erase("assumed_channels");
}

/// The event that describes the merge.
void describe(Merged& merged, const Recording& truth, bool delay_given) {
  nlohmann::ordered_json detail = {{"truth", truth.source},
                                   {"delay_s", merged.delay_s},
                                   {"delay", delay_given ? "given" : "estimated"},
                                   {"rows_with_truth", merged.rows_with_truth}};
  auto& meta = merged.recording.meta;
  meta["merge.truth"] = truth.source;
  meta["merge.delay_s"] = fmt::format("{:.7f}", merged.delay_s);
  meta["merge.delay"] = delay_given ? "given" : "estimated";
  if (merged.estimate) {
    detail["estimated_delay_s"] = merged.estimate->delay_s;
    detail["sigma_s"] = merged.estimate->sigma_s;
    detail["correlation"] = merged.estimate->correlation;
    meta["merge.estimated_delay_s"] = fmt::format("{:.7f}", merged.estimate->delay_s);
    meta["merge.estimated_delay_sigma_s"] = fmt::format("{:.7f}", merged.estimate->sigma_s);
  }
  if (merged.clock) {
    detail["wall_minus_truth_clock_ns"] = merged.clock->offset_ns;
    detail["drift_ppm"] = merged.clock->drift_ppm;
    meta["merge.wall_minus_truth_clock_ns"] = fmt::format("{}", merged.clock->offset_ns);
    meta["merge.drift_ppm"] = fmt::format("{:.6f}", merged.clock->drift_ppm);
  }
  for (const auto& joint : merged.joints) {
    for (const char* key : {".scale", ".zero_counts", ".zero_position"}) {
      const auto found = truth.meta.find(joint.name + key);
      if (found != truth.meta.end()) meta[found->first] = found->second;
    }
  }
  std::string& known = meta[std::string(kKnownImplausible)];
  for (const auto& joint : merged.joints) {
    if (truth.meta.contains(joint.name + ".plausible")) add_to_list(known, "truth." + joint.name);
  }
  if (known.empty()) meta.erase(std::string(kKnownImplausible));
  merged.recording.events.insert(merged.recording.events.begin(),
                                 {merged.recording.t_ns.front(), "merge", detail.dump()});
}

}  // namespace

core::Result<Merged> merge_truth(const Recording& robot, const Recording& truth,
                                 const MergeOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(const Columns columns, matching_columns(robot, truth));
  RAVENCAL_ASSIGN_OR_RETURN(const TruthTime time, relate_clocks(robot, truth, options));
  const std::vector<std::int64_t> truth_t_ns = time.on_robot_clock(truth.t_ns);
  Merged merged;
  merged.clock = time.clock;
  const auto estimate = estimate_delay(track_of(robot.t_ns, robot.samples, columns.robot),
                                       track_of(truth_t_ns, truth.samples, columns.truth),
                                       columns.joints, options.delay);
  if (!estimate.ok() && !options.fixed_delay_s) return estimate.error();
  if (estimate.ok()) merged.estimate = *estimate;
  merged.delay_s = options.fixed_delay_s.value_or(estimate.ok() ? estimate->delay_s : 0.0);
  merged.recording = robot;
  drop_truth_channels(merged.recording);
  for (std::size_t i = 0; i < columns.joints.size(); ++i) {
    const Eigen::Index column = columns.truth[i];
    const std::span<const double> values(truth.samples.col(column).data(), truth_t_ns.size());
    const std::int64_t rows =
        add_truth(merged.recording, truth.channels[static_cast<std::size_t>(column)],
                  Interpolator(truth_t_ns, values, options.longest_gap_ns), 1e9 * merged.delay_s);
    merged.joints.push_back({columns.joints[i], rows});
  }
  const auto added = static_cast<Eigen::Index>(columns.truth.size());
  for (Eigen::Index row = 0; row < merged.recording.rows(); ++row) {
    merged.rows_with_truth +=
        merged.recording.samples.row(row).tail(added).array().isFinite().all() ? 1 : 0;
  }
  add_events(merged, truth, time);
  keep_assumptions(merged, truth);
  describe(merged, truth, options.fixed_delay_s.has_value());
  return merged;
}

}  // namespace ravencal::record
