// SPDX-License-Identifier: Apache-2.0
#include "robot/run_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/catalogue.hpp"
#include "core/version.hpp"
#include "record/profile.hpp"

namespace ravencal::robot {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::int64_t kLongestGapNs = 50'000'000;
constexpr std::int64_t kLongestWaitNs = kSecondNs / 2;  // for a reading that never comes
constexpr std::size_t kTime = core::catalogue_index(core::RavenField::kTime, 0);
constexpr double kLost = std::numeric_limits<double>::quiet_NaN();
// A state may come a hair before its time: half a control cycle.
constexpr std::int64_t kEarlyNs = 500'000;

}  // namespace

core::Result<RunRecorder> RunRecorder::create(const RunRecorderOptions& options) {
  record::ProfileOptions profile_options;
  profile_options.arm = options.arm;
  RAVENCAL_ASSIGN_OR_RETURN(const record::Profile profile,
                            record::load_profile("raven2", profile_options));
  std::vector<record::Channel> channels;
  for (const auto& channel : profile.channels) channels.push_back(channel.channel);
  const std::map<std::string, std::string> meta = {{"robot", profile.robot},
                                                   {"arm", options.arm},
                                                   {"profile", "raven2"},
                                                   {"source", "ravencal run"},
                                                   {"trajectory", options.trajectory},
                                                   {"clock", "CLOCK_REALTIME of the robot"},
                                                   {"software_version", core::kVersion}};
  RAVENCAL_ASSIGN_OR_RETURN(
      record::RecordingWriter writer,
      record::RecordingWriter::create(options.path, meta, channels, options.overwrite));
  return RunRecorder(std::move(writer), options);
}

RunRecorder::RunRecorder(record::RecordingWriter writer, const RunRecorderOptions& options)
    : writer_(std::move(writer)), period_ns_(std::llround(1e9 / options.rate_hz)) {}

core::Status RunRecorder::take(const record::RavenStateMessage& state, bool moving) {
  if (first_ns_ == 0) {
    first_ns_ = state.stamp_ns;
    RAVENCAL_RETURN_IF_ERROR(writer_.set_meta(
        "origin.time", fmt::format("{}", 1e-9 * static_cast<double>(state.stamp_ns))));
  }
  if (state.stamp_ns <= last_ns_) return {};
  last_ns_ = state.stamp_ns;
  if (moving && state.stamp_ns + kEarlyNs >= next_row_ns_) {
    waiting_.push_back(state);
    next_row_ns_ = std::max(next_row_ns_, state.stamp_ns - period_ns_) + period_ns_;
  }
  return write_ready(false);
}

void RunRecorder::take_truth(std::int64_t stamp_ns, const std::array<double, 3>& joints_ji) {
  if (!readings_.empty() && stamp_ns <= readings_.back().stamp_ns) return;
  readings_.push_back({stamp_ns, joints_ji});
  const std::int64_t oldest_ns =
      (waiting_.empty() ? std::min(last_ns_, stamp_ns) : waiting_.front().stamp_ns) - kSecondNs;
  while (readings_.size() > 2 && readings_[1].stamp_ns < oldest_ns) readings_.pop_front();
}

/// Between the readings around it, both of which are there or will never be.
std::array<double, 3> RunRecorder::truth_at(std::int64_t stamp_ns) {
  const auto after = std::lower_bound(
      readings_.begin(), readings_.end(), stamp_ns,
      [](const Reading& reading, std::int64_t t_ns) { return reading.stamp_ns < t_ns; });
  if (after == readings_.end()) return {kLost, kLost, kLost};
  if (after->stamp_ns == stamp_ns) return after->joints_ji;
  if (after == readings_.begin()) return {kLost, kLost, kLost};
  const Reading& before = *std::prev(after);
  if (after->stamp_ns - before.stamp_ns > kLongestGapNs) return {kLost, kLost, kLost};
  const double share = static_cast<double>(stamp_ns - before.stamp_ns) /
                       static_cast<double>(after->stamp_ns - before.stamp_ns);
  std::array<double, 3> joints{};
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joints[j] = before.joints_ji[j] + share * (after->joints_ji[j] - before.joints_ji[j]);
  }
  return joints;
}

core::Status RunRecorder::write_ready(bool all) {
  while (!waiting_.empty()) {
    const record::RavenStateMessage& state = waiting_.front();
    const bool has_reading = !readings_.empty() && readings_.back().stamp_ns >= state.stamp_ns;
    if (!all && !has_reading && last_ns_ - state.stamp_ns < kLongestWaitNs) return {};
    const std::array<double, 3> truth = truth_at(state.stamp_ns);
    row_.assign(truth.begin(), truth.end());
    row_.insert(row_.end(), state.values.begin(), state.values.end());
    row_[truth.size() + kTime] = 1e-9 * static_cast<double>(state.stamp_ns - first_ns_);
    RAVENCAL_RETURN_IF_ERROR(writer_.append(state.stamp_ns, row_));
    ++rows_;
    if (!std::isnan(truth[0])) ++rows_with_truth_;
    waiting_.pop_front();
  }
  return {};
}

core::Status RunRecorder::note(std::int64_t stamp_ns, const std::string& kind,
                               const std::string& detail) {
  return writer_.append_event({stamp_ns == 0 ? last_ns_ : stamp_ns, kind, detail});
}

core::Status RunRecorder::finish() {
  RAVENCAL_RETURN_IF_ERROR(write_ready(true));
  return writer_.finish();
}

}  // namespace ravencal::robot
