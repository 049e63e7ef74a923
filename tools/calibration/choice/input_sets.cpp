// SPDX-License-Identifier: Apache-2.0
#include "choice/input_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "core/catalogue.hpp"
#include "learn/dataset.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::choice {
namespace {

using model::FeatureSpec;
using model::Transform;
using record::Channel;
using record::Recording;
using record::Role;

/// Half-widths of play operators in shares of a position's range of motion. Friction and stretch of
/// published cable drives turn within 0.3 to 20 % of it.
constexpr std::array kPlayShares = {0.004, 0.008, 0.016, 0.032, 0.064, 0.128, 0.256};
/// Lengths of means over the travel, in shares of the range: within a stroke, and over some.
constexpr std::array kTravelShares = {1.0 / 60.0, 1.0 / 12.0, 1.0 / 3.0};
constexpr std::array kSizeShares = {1.0 / 3.0, 5.0 / 3.0};
/// Smoothing of efforts: current noise of a motor drive is faster, a stroke slower.
constexpr float kSmoothingS = 0.03F;
/// Rows farther apart do not show a drive's dynamics.
constexpr double kDynamicsPeriodS = 0.1;
/// A position less its mean over so long is the way that the joint has just come: within a stroke
/// it has the sign of the motion and fades in over it, as presliding friction does.
constexpr float kRecentS = 1.0F;
/// How long before a position was: from one cycle of a slow controller to the lag of a soft drive.
constexpr std::array kEarlierS = {0.02, 0.04, 0.08, 0.16};
/// A joint that moved by less was held: encoder noise, and the give of the brakes.
constexpr double kHeldRad = 0.02;
constexpr double kHeldM = 0.002;
/// Messages with more channels are whole robot states, most of which say nothing about a cable.
constexpr std::size_t kFewChannels = 60;

bool is_raven(std::span<const model::OutputSpec> outputs) {
  return std::all_of(outputs.begin(), outputs.end(), [](const model::OutputSpec& output) {
    return core::catalogue_index_of(output.estimate_channel).has_value();
  });
}

bool is_effort(const Channel& channel) {
  if (channel.role == Role::kDriveTorque || channel.role == Role::kDriveInput) return true;
  constexpr std::array<std::string_view, 4> kEffortUnits = {"N_m", "N", "A", "V"};
  return channel.role == Role::kFeature &&
         std::find(kEffortUnits.begin(), kEffortUnits.end(), channel.unit) != kEffortUnits.end();
}

bool is_position(const Channel& channel) {
  return channel.role == Role::kJointEstimate || channel.role == Role::kMotorPosition;
}

/// Least and largest value of a channel over all recordings.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  [[nodiscard]] double width() const { return high > low ? high - low : 0.0; }
};

Range range_of(std::span<const Recording* const> recordings, const std::string& name) {
  Range range;
  for (const Recording* recording : recordings) {
    const auto column = recording->column(name);
    if (!column) continue;
    for (const double value : recording->samples.col(*column)) {
      if (!std::isfinite(value)) continue;
      range.low = std::min(range.low, value);
      range.high = std::max(range.high, value);
    }
  }
  return range;
}

bool is_in_all(std::span<const Recording* const> recordings, const std::string& name) {
  return std::all_of(recordings.begin(), recordings.end(),
                     [&](const Recording* recording) { return recording->column(name); });
}

std::vector<std::string> held_joints(std::span<const Recording* const> recordings) {
  std::vector<std::string> held;
  for (const Channel& channel : recordings.front()->channels) {
    if (channel.role != Role::kJointEstimate) continue;
    const double least = channel.unit == "m" ? kHeldM : kHeldRad;
    if (!(range_of(recordings, channel.name).width() >= least)) held.push_back(channel.joint);
  }
  return held;
}

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// What an input tells beside the present.
enum class Tells { kNow, kMemory, kRecent };

/// Collects inputs and, beside each, the joint that it belongs to and what it tells.
class Collector {
 public:
  Collector(std::span<const Recording* const> recordings,
            std::span<const model::OutputSpec> outputs)
      : recordings_(recordings),
        outputs_(outputs),
        row_period_s_(model::row_period_s(*recordings.front())),
        held_(held_joints(recordings)) {
    const bool raven = is_raven(outputs);
    const std::vector<Channel>& channels = recordings.front()->channels;
    for (const Channel& channel : channels) {
      const double width = range_of(recordings_, channel.name).width();
      if (!(width > 0.0) || !is_in_all(recordings_, channel.name)) continue;
      if (holds(held_, channel.joint)) continue;
      if (raven ? channel.role == Role::kJointEstimate : is_position(channel)) {
        add_position(channel, width);
        if (is_dynamic()) add_recent(channel, !raven);
      } else if (raven) {
        continue;
      } else if (is_effort(channel)) {
        add_effort(channel);
      } else if (channel.role == Role::kTemperature ||
                 (channel.role == Role::kFeature && channels.size() <= kFewChannels)) {
        add({channel.name}, channel.joint, Tells::kNow);
      }
    }
  }

  [[nodiscard]] InputSets result() const {
    InputSets sets{features_, positions_, {}, held_};
    for (const model::OutputSpec& output : outputs_) {
      OutputInputs& inputs = sets.of_output.emplace_back();
      if (holds(held_, output.joint)) continue;
      const auto own = [&](std::size_t i) {
        return joints_[i].empty() || joints_[i] == output.joint;
      };
      const auto own_without = [&](auto... left_out) {
        return [=, this](std::size_t i) { return own(i) && (... && (tells_[i] != left_out)); };
      };
      add_set(inputs.own, "own inputs as they are", own_without(Tells::kMemory, Tells::kRecent));
      add_set(inputs.own, "own inputs and their memory", own_without(Tells::kRecent));
      add_set(inputs.own, "own and recent inputs", own_without(Tells::kMemory));
      add_set(inputs.own, "own and recent inputs and their memory", own);
      add_blocks(output, inputs.others);
    }
    return sets;
  }

 private:
  void add(FeatureSpec feature, const std::string& joint, Tells tells) {
    features_.push_back(std::move(feature));
    joints_.push_back(joint);
    tells_.push_back(tells);
  }

  void add_blocks(const model::OutputSpec& output, std::vector<InputSet>& blocks) const {
    const std::set<std::string> joints(joints_.begin(), joints_.end());
    for (const std::string& joint : joints) {
      if (joint.empty() || joint == output.joint) continue;
      const auto of_joint = [&](bool now, bool memory) {
        add_set(blocks, joint, [&](std::size_t i) {
          return joints_[i] == joint &&
                 ((now && tells_[i] == Tells::kNow) || (memory && tells_[i] == Tells::kMemory));
        });
      };
      of_joint(true, false);
      of_joint(false, true);
      of_joint(true, true);
    }
  }

  void add_position(const Channel& channel, double width) {
    positions_.push_back(static_cast<Eigen::Index>(features_.size()));
    add({channel.name}, channel.joint, Tells::kNow);
    for (const double share : kPlayShares) {
      add({.channel = channel.name,
           .transform = Transform::kPlay,
           .play_half_width = static_cast<float>(share * width)},
          channel.joint, Tells::kMemory);
    }
  }

  void add_recent(const Channel& channel, bool earlier) {
    add({.channel = channel.name, .transform = Transform::kMean, .time_constant_s = kRecentS},
        channel.joint, Tells::kRecent);
    std::uint32_t last = 0;
    for (const double before_s : kEarlierS) {
      const auto rows = static_cast<std::uint32_t>(std::lround(before_s / row_period_s_));
      if (rows <= last || !earlier) continue;
      last = rows;
      add({.channel = channel.name, .transform = Transform::kLag, .lag_rows = rows}, channel.joint,
          Tells::kRecent);
    }
  }

  [[nodiscard]] bool is_dynamic() const { return row_period_s_ <= kDynamicsPeriodS; }

  void add_effort(const Channel& channel) {
    if (!is_dynamic()) {
      add({channel.name}, channel.joint, Tells::kNow);
      return;
    }
    add({.channel = channel.name, .transform = Transform::kMean, .time_constant_s = kSmoothingS},
        channel.joint, Tells::kNow);
    for (const model::OutputSpec& output : outputs_) {
      if (channel.joint.empty() || channel.joint == output.joint) add_travel_means(channel, output);
    }
  }

  /// Means over the travel of the joint that the effort moves.
  void add_travel_means(const Channel& channel, const model::OutputSpec& output) {
    if (holds(held_, output.joint)) return;
    const double width = range_of(recordings_, output.estimate_channel).width();
    const auto mean = [&](Transform transform, double share) {
      add({.channel = channel.name,
           .transform = transform,
           .travel_si = static_cast<float>(share * width),
           .along = output.estimate_channel},
          output.joint, Tells::kMemory);
    };
    for (const double share : kTravelShares) mean(Transform::kTravelMean, share);
    for (const double share : kSizeShares) mean(Transform::kTravelMeanOfAbs, share);
  }

  template <typename Test>
  [[nodiscard]] InputSet set_of(std::string name, const Test& test) const {
    InputSet set{std::move(name), {}};
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (test(i)) set.columns.push_back(static_cast<Eigen::Index>(i));
    }
    return set;
  }

  template <typename Test>
  void add_set(std::vector<InputSet>& sets, std::string name, const Test& test) const {
    InputSet set = set_of(std::move(name), test);
    const bool is_new = std::none_of(sets.begin(), sets.end(), [&](const InputSet& other) {
      return other.columns == set.columns;
    });
    if (is_new && !set.columns.empty()) sets.push_back(std::move(set));
  }

  std::span<const Recording* const> recordings_;
  std::span<const model::OutputSpec> outputs_;
  double row_period_s_;
  std::vector<std::string> held_;
  std::vector<FeatureSpec> features_;
  std::vector<std::string> joints_;  ///< of each feature; empty: of no joint
  std::vector<Tells> tells_;         ///< of each feature
  std::vector<Eigen::Index> positions_;
};

}  // namespace

core::Result<InputSets> offered_inputs(std::span<const Recording* const> recordings,
                                       std::span<const model::OutputSpec> outputs) {
  InputSets sets = Collector(recordings, outputs).result();
  if (!sets.features.empty()) return sets;
  return core::data_error(
      fmt::format("{}: no joint moves by more than {} rad or {} mm in the training, and no effort "
                  "or other input "
                  "changes",
                  recordings.front()->source, kHeldRad, 1e3 * kHeldM));
}

InputSets given_inputs(std::vector<FeatureSpec> features, const Recording& recording,
                       std::size_t outputs) {
  std::vector<Eigen::Index> positions;
  InputSet plain{"inputs as they are", {}};
  InputSet all{"inputs and their memory", {}};
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    all.columns.push_back(column);
    if (features[i].transform != Transform::kValue) continue;
    plain.columns.push_back(column);
    const auto channel = recording.column(features[i].channel);
    if (channel && is_position(recording.channels[static_cast<std::size_t>(*channel)]))
      positions.push_back(column);
  }
  std::vector<InputSet> sets;
  if (!plain.columns.empty()) sets.push_back(plain);
  if (plain.columns.size() < all.columns.size()) sets.push_back(all);
  return {std::move(features),
          std::move(positions),
          std::vector<OutputInputs>(outputs, {std::move(sets), {}}),
          {}};
}

}  // namespace ravencal::choice
