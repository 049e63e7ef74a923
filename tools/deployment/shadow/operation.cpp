// SPDX-License-Identifier: Apache-2.0
#include "shadow/operation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/run_level.hpp"

namespace ravencal::shadow {
namespace {

constexpr std::array<const char*, RAVENCAL_JOINTS> kJoints = {"shoulder", "elbow", "insertion"};

/// Columns of the channels that monitor/tick_recording.cpp writes.
class Columns {
 public:
  explicit Columns(const record::Recording& recording) : recording_(recording) {}

  double operator()(const std::string& channel, Eigen::Index row) {
    const auto [entry, is_new] = columns_.try_emplace(channel, -1);
    if (is_new) entry->second = recording_.column(channel).value_or(-1);
    if (entry->second >= 0) return recording_.samples(row, entry->second);
    missing_ = channel;
    return 0.0;
  }
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  const record::Recording& recording_;
  std::map<std::string, Eigen::Index> columns_;
  std::string missing_;
};

template <typename Counts>
void count(Counts& counts, double index) {
  const auto i = static_cast<std::size_t>(index);
  if (index >= 0.0 && i < counts.size()) ++counts[i];
}

bool is_corrected(double state) {
  return state == RAVENCAL_STATE_FADING_IN || state == RAVENCAL_STATE_ACTIVE ||
         state == RAVENCAL_STATE_HOLD || state == RAVENCAL_STATE_CONSTANT;
}

void raise(double& most, double value) { most = std::max(most, std::fabs(value)); }

bool is_pedal_down(double runlevel) { return static_cast<int>(runlevel) == core::kPedalDown; }

/// `follows`, `followed`: the pedal is down in this row, and in the one before, without a gap.
void add_joint(JointOperation& joint, const std::string& name, Columns& value, Eigen::Index row,
               bool follows, bool followed, bool has_gap) {
  const double correction_ji = value("would_be." + name, row);
  const double raw_ji = value("jpos." + name, row);
  raise(joint.largest_ji, correction_ji);
  raise(joint.offset_ji, value("offset." + name, row));
  joint.lowest_ji = row == 0 ? raw_ji : std::min(joint.lowest_ji, raw_ji);
  joint.highest_ji = row == 0 ? raw_ji : std::max(joint.highest_ji, raw_ji);
  if (!follows || row == 0 || has_gap) return;
  const double change_ji = correction_ji - value("would_be." + name, row - 1);
  raise(followed ? joint.follow_change_ji : joint.press_change_ji, change_ji);
}

void add_row(Operation& operation, Columns& value, Eigen::Index row) {
  const bool follows = is_pedal_down(value("runlevel", row));
  const bool followed = row > 0 && is_pedal_down(value("runlevel", row - 1));
  const double step = row > 0 ? value("tick", row) - value("tick", row - 1) : 1.0;
  const bool has_gap = step != 1.0;
  if (step > 1.0) operation.lost_ticks += static_cast<std::uint64_t>(step) - 1;
  const double would_be = value("would_be_state", row);
  ++operation.ticks;
  operation.shadow_ticks += value("state", row) == RAVENCAL_STATE_SHADOW ? 1 : 0;
  operation.pedal_down_ticks += follows ? 1 : 0;
  operation.corrected_ticks += follows && is_corrected(would_be) ? 1 : 0;
  operation.presses += row > 0 && follows && !followed ? 1 : 0;
  count(operation.ticks_in_state, would_be);
  const auto doubts = static_cast<std::uint32_t>(value("doubts", row));
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    operation.ticks_in_doubt[kind] += (doubts >> kind) & 1U;
  }
  const double step_s = value("step", row);
  operation.longest_step_s = std::max(operation.longest_step_s, step_s);
  operation.long_steps += step_s > 0.5 * operation.tick_s ? 1 : 0;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    add_joint(operation.joints[j], kJoints[j], value, row, follows, followed, has_gap);
  }
}

/// The commonest step of time between ticks that follow each other.
double tick_s_of(const record::Recording& recording) {
  std::map<std::int64_t, int> steps;
  for (std::size_t row = 1; row < recording.t_ns.size(); ++row) {
    ++steps[recording.t_ns[row] - recording.t_ns[row - 1]];
  }
  const auto most = std::max_element(
      steps.begin(), steps.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == steps.end() ? 1e-3 : static_cast<double>(most->first) * 1e-9;
}

}  // namespace

bool is_of_monitor(const record::Recording& recording) {
  const auto profile = recording.meta.find("profile");
  return profile != recording.meta.end() && profile->second == "telemetry";
}

core::Result<Operation> operation_in(const record::Recording& recording) {
  if (recording.rows() == 0) {
    return core::Error{core::ErrorCode::kData, recording.source + ": there is no tick"};
  }
  Operation operation;
  operation.tick_s = tick_s_of(recording);
  Columns columns(recording);
  for (Eigen::Index row = 0; row < recording.rows(); ++row) add_row(operation, columns, row);
  if (!columns.missing().empty()) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: has no channel '{}'; `ravencal monitor --record` of this "
                                   "version writes it",
                                   recording.source, columns.missing())};
  }
  return operation;
}

}  // namespace ravencal::shadow
