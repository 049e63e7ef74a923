// SPDX-License-Identifier: Apache-2.0
#include "shadow/operation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/constants.hpp"
#include "core/run_level.hpp"

namespace ravencal::shadow {
namespace {

constexpr std::array<const char*, RAVENCAL_JOINTS> kJoints = {"shoulder", "elbow", "insertion"};

enum JointChannel { kRaw, kWouldBe, kOffset, kJointChannels };
enum Channel { kRunlevel, kState, kWouldBeState, kDoubts, kStep, kTick, kChannels };

/// The channels that monitor/tick_recording.cpp writes; a value that is lost counts as 0.
class Rows {
 public:
  static core::Result<Rows> of(const record::Recording& recording) {
    constexpr std::array<const char*, kJointChannels> kPerJoint = {"jpos.", "would_be.", "offset."};
    constexpr std::array<const char*, kChannels> kCommon = {"runlevel", "state", "would_be_state",
                                                            "doubts",   "step",  "tick"};
    Rows rows;
    const auto find = [&](const std::string& name, const double*& values) -> core::Status {
      const auto column = recording.column(name);
      if (column) {
        values = recording.samples.col(*column).data();
        return {};
      }
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: has no channel '{}'; `ravencal monitor --record` of this "
                                     "version writes it",
                                     recording.source, name)};
    };
    for (std::size_t j = 0; j < kJoints.size(); ++j) {
      for (std::size_t kind = 0; kind < kPerJoint.size(); ++kind) {
        RAVENCAL_RETURN_IF_ERROR(
            find(std::string(kPerJoint[kind]) + kJoints[j], rows.joints_[j][kind]));
      }
    }
    for (std::size_t i = 0; i < kCommon.size(); ++i) {
      RAVENCAL_RETURN_IF_ERROR(find(kCommon[i], rows.common_[i]));
    }
    return rows;
  }

  [[nodiscard]] double at(Channel channel, Eigen::Index row) const {
    return or_none(common_[channel][row]);
  }
  [[nodiscard]] double at(JointChannel channel, std::size_t joint, Eigen::Index row) const {
    return or_none(joints_[joint][channel][row]);
  }

 private:
  static double or_none(double value) { return std::isfinite(value) ? value : 0.0; }

  std::array<std::array<const double*, kJointChannels>, RAVENCAL_JOINTS> joints_{};
  std::array<const double*, kChannels> common_{};
};

template <typename Counts>
void count(Counts& counts, double index) {
  if (index >= 0.0 && index < static_cast<double>(counts.size())) {
    ++counts[static_cast<std::size_t>(index)];
  }
}

/// Bits that a double holds exactly; none where it is no such number.
std::uint32_t bits_of(double value) {
  constexpr double kEnd = 4294967296.0;  // 2^32
  return value >= 0.0 && value < kEnd ? static_cast<std::uint32_t>(value) : 0U;
}

bool is_corrected(double state) {
  return state == RAVENCAL_STATE_FADING_IN || state == RAVENCAL_STATE_ACTIVE ||
         state == RAVENCAL_STATE_HOLD || state == RAVENCAL_STATE_CONSTANT;
}

void raise(double& most, double value) { most = std::max(most, std::fabs(value)); }

bool is_pedal_down(double runlevel) { return runlevel == static_cast<double>(core::kPedalDown); }

/// `follows`, `followed`: the pedal is down in this row, and in the one before, without a gap.
void add_joint(JointOperation& joint, std::size_t j, const Rows& rows, Eigen::Index row,
               bool follows, bool followed, bool has_gap) {
  const double correction_ji = rows.at(kWouldBe, j, row);
  const double raw_ji = rows.at(kRaw, j, row);
  raise(joint.largest_ji, correction_ji);
  raise(joint.offset_ji, rows.at(kOffset, j, row));
  joint.lowest_ji = row == 0 ? raw_ji : std::min(joint.lowest_ji, raw_ji);
  joint.highest_ji = row == 0 ? raw_ji : std::max(joint.highest_ji, raw_ji);
  if (!follows || row == 0 || has_gap) return;
  const double change_ji = correction_ji - rows.at(kWouldBe, j, row - 1);
  raise(followed ? joint.follow_change_ji : joint.press_change_ji, change_ji);
}

void add_row(Operation& operation, const Rows& rows, Eigen::Index row) {
  const bool follows = is_pedal_down(rows.at(kRunlevel, row));
  const bool followed = row > 0 && is_pedal_down(rows.at(kRunlevel, row - 1));
  const double step = row > 0 ? rows.at(kTick, row) - rows.at(kTick, row - 1) : 1.0;
  const bool has_gap = step != 1.0;
  // A restarted plugin counts anew.
  if (step > 1.0) operation.lost_ticks += static_cast<std::uint64_t>(step) - 1;
  const double would_be = rows.at(kWouldBeState, row);
  ++operation.ticks;
  operation.shadow_ticks += rows.at(kState, row) == RAVENCAL_STATE_SHADOW ? 1 : 0;
  operation.pedal_down_ticks += follows ? 1 : 0;
  operation.corrected_ticks += follows && is_corrected(would_be) ? 1 : 0;
  operation.presses += row > 0 && follows && !followed ? 1 : 0;
  count(operation.ticks_in_state, would_be);
  const std::uint32_t doubts = bits_of(rows.at(kDoubts, row));
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    operation.ticks_in_doubt[kind] += (doubts >> kind) & 1U;
  }
  const double step_s = rows.at(kStep, row);
  operation.longest_step_s = std::max(operation.longest_step_s, step_s);
  operation.long_steps += step_s > 0.5 * operation.tick_s ? 1 : 0;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    add_joint(operation.joints[j], j, rows, row, follows, followed, has_gap);
  }
}

/// As the plugin was set to.
core::Result<double> tick_s_of(const record::Recording& recording) {
  const auto stated = recording.meta.find("tick_ns");
  double tick_ns = 0.0;
  if (stated != recording.meta.end()) {
    const std::string& text = stated->second;
    std::from_chars(text.data(), text.data() + text.size(), tick_ns);
  }
  if (tick_ns > 0.0) return tick_ns * core::kSecondsPerNs;
  return core::Error{core::ErrorCode::kData,
                     recording.source +
                         ": meta 'tick_ns' is missing or no length of a tick; "
                         "`ravencal monitor --record` of this version writes it"};
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
  RAVENCAL_ASSIGN_OR_RETURN(operation.tick_s, tick_s_of(recording));
  RAVENCAL_ASSIGN_OR_RETURN(const Rows rows, Rows::of(recording));
  for (Eigen::Index row = 0; row < recording.rows(); ++row) add_row(operation, rows, row);
  return operation;
}

}  // namespace ravencal::shadow
