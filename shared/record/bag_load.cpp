// SPDX-License-Identifier: Apache-2.0
#include "record/bag_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "core/units.hpp"
#include "record/bag_file.hpp"
#include "record/profile_builtin.hpp"

namespace ravencal::record {
namespace {

constexpr double kLost = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kLongestGapNs = 50'000'000;  // of the truth, as in `ravencal merge`
constexpr std::size_t kJoints = core::kCalibratedJointCount;
using JointPositions = std::array<double, kJoints>;

std::string last_word(const std::string& topic) {
  return topic.substr(topic.find_last_of('/') + 1);
}

class BagLoader {
 public:
  BagLoader(std::filesystem::path path, std::vector<BagTopic> topics, const Profile& profile,
            bool skip_bad)
      : path_(std::move(path)),
        topics_(std::move(topics)),
        profile_(profile),
        gold_(profile.arm == "gold"),
        skip_bad_(skip_bad) {}

  core::Result<Recording> load() {
    RAVENCAL_RETURN_IF_ERROR(read_truth());
    if (profile_.name == kBagTruthProfile) {
      if (truth_t_ns_.empty()) return failed("has no topic ext_jpos of sensor_msgs/JointState");
      return truth_alone();
    }
    RAVENCAL_RETURN_IF_ERROR(read_states());
    return states_with_truth();
  }

 private:
  [[nodiscard]] core::Error failed(std::string_view why) const {
    return {core::ErrorCode::kData, fmt::format("{}: {}", path_.string(), why)};
  }

  /// The topic of that type: the one that the profile names, else the only one, else that called
  /// `usual`.
  core::Result<std::optional<BagTopic>> find_topic(const RosMessageType& type,
                                                   const std::string& wanted,
                                                   const std::string& usual) const {
    std::vector<BagTopic> fitting;
    std::string names;
    for (const BagTopic& topic : topics_) {
      if (topic.type != type.name) continue;
      if (!wanted.empty() && topic.name != wanted) continue;
      fitting.push_back(topic);
      names += " " + topic.name;
    }
    if (fitting.size() > 1) {
      const auto called = std::find_if(fitting.begin(), fitting.end(), [&](const BagTopic& topic) {
        return last_word(topic.name) == usual;
      });
      if (called == fitting.end()) {
        return failed(
            fmt::format("several topics of {}:{}; a profile file says which", type.name, names));
      }
      fitting = {*called};
    }
    if (fitting.empty()) return std::optional<BagTopic>();
    if (fitting.front().md5 != type.md5) {
      return failed(fmt::format(
          "{} is a {} of another revision: md5 {}, but ravencal reads {}; `rosbag fix` converts "
          "bags between revisions",
          fitting.front().name, type.name, fitting.front().md5, type.md5));
    }
    return std::optional(fitting.front());
  }

  /// A message that cannot be used: an error, or an event if such are to be skipped.
  core::Status bad_message(const std::string& topic, std::size_t number, std::int64_t t_ns,
                           std::string_view why) {
    std::string text = fmt::format("{}, message {}: {}", topic, number, why);
    if (!skip_bad_) return failed(text + "; --skip-bad leaves such messages out");
    drops_.push_back({t_ns, "drop", std::move(text)});
    return {};
  }

  core::Status read_truth() {
    RAVENCAL_ASSIGN_OR_RETURN(const auto topic, find_truth_topic());
    if (!topic) return {};
    std::size_t number = 0;
    return for_each_message(
        path_, topic->name, [&](std::int64_t received_ns, auto bytes) -> core::Status {
          ++number;
          const auto message = decode_joint_state(bytes);
          if (!message || message->positions.size() != kJoints)
            return bad_message(topic->name, number, received_ns, "has not three positions");
          const std::int64_t t_ns = message->stamp_ns != 0 ? message->stamp_ns : received_ns;
          if (!truth_t_ns_.empty() && t_ns < truth_t_ns_.back())
            return bad_message(topic->name, number, received_ns,
                               "its stamp is before the last one's");
          truth_t_ns_.push_back(t_ns);
          truth_.push_back({message->positions[0], message->positions[1], message->positions[2]});
          return {};
        });
  }

  /// Many things are JointStates: only the one called ext_jpos, or the one named, is the truth.
  [[nodiscard]] core::Result<std::optional<BagTopic>> find_truth_topic() const {
    for (const BagTopic& topic : topics_) {
      const bool right = profile_.truth_topic.empty() ? last_word(topic.name) == kTruthTopic
                                                      : topic.name == profile_.truth_topic;
      if (right) return find_topic(joint_state_type(), topic.name, std::string(kTruthTopic));
    }
    return std::optional<BagTopic>();
  }

  core::Status read_states() {
    RAVENCAL_ASSIGN_OR_RETURN(const auto topic, find_topic(raven_state_type(), profile_.state_topic,
                                                           std::string(kStateTopic)));
    if (!topic) {
      std::string names;
      for (const BagTopic& other : topics_)
        names += fmt::format(" {} ({})", other.name, other.type);
      return failed(fmt::format("has no topic of raven_2/raven_state{}{}; its topics:{}",
                                profile_.state_topic.empty() ? "" : " called ",
                                profile_.state_topic, names.empty() ? " none" : names));
    }
    std::size_t number = 0;
    return for_each_message(
        path_, topic->name, [&](std::int64_t received_ns, auto bytes) -> core::Status {
          ++number;
          auto message = decode_raven_state(bytes, gold_);
          if (!message) {
            return bad_message(topic->name, number, received_ns,
                               fmt::format("{} bytes are no raven_state", bytes.size()));
          }
          if (message->stamp_ns == 0) message->stamp_ns = received_ns;
          if (!states_.empty() && message->stamp_ns < states_.back().stamp_ns) {
            return bad_message(
                topic->name, number, received_ns,
                fmt::format(
                    "its stamp is {:.3f} ms before the last one's: the clock was stepped",
                    1e-6 * static_cast<double>(states_.back().stamp_ns - message->stamp_ns)));
          }
          states_.push_back(*message);
          return {};
        });
  }

  Recording empty_recording() {
    Recording recording;
    recording.source = path_.string();
    recording.meta["profile"] = profile_.name;
    recording.meta["source"] = path_.filename().string();
    recording.meta["robot"] = profile_.robot;
    recording.meta["arm"] = profile_.arm;
    recording.events = std::move(drops_);
    if (!recording.events.empty())
      recording.meta["dropped_rows"] = std::to_string(recording.events.size());
    return recording;
  }

  Recording truth_alone() {
    Recording recording = empty_recording();
    for (std::size_t j = 0; j < kJoints; ++j) recording.channels.push_back(si_channel(j));
    recording.samples.resize(static_cast<Eigen::Index>(truth_.size()), kJoints);
    for (std::size_t row = 0; row < truth_.size(); ++row) {
      for (std::size_t j = 0; j < kJoints; ++j)
        recording.samples(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(j)) =
            truth_[row][j];
    }
    recording.t_ns = truth_t_ns_;
    return recording;
  }

  /// Channel `i` of the profile, in SI units as recordings are in memory.
  [[nodiscard]] Channel si_channel(std::size_t i) const {
    Channel channel = profile_.channels[i].channel;
    channel.unit = core::find_unit(channel.unit)->si_name;
    return channel;
  }

  core::Result<Recording> states_with_truth() {
    if (states_.empty()) return failed("its topic of raven_2/raven_state is empty");
    Recording recording = empty_recording();
    const std::size_t first = truth_t_ns_.empty() ? kJoints : 0;
    for (std::size_t i = first; i < profile_.channels.size(); ++i)
      recording.channels.push_back(si_channel(i));
    recording.samples.resize(static_cast<Eigen::Index>(states_.size()),
                             static_cast<Eigen::Index>(recording.channels.size()));
    const std::size_t truths = kJoints - first;
    for (std::size_t row = 0; row < states_.size(); ++row) {
      const RavenStateMessage& state = states_[row];
      recording.t_ns.push_back(state.stamp_ns);
      const auto r = static_cast<Eigen::Index>(row);
      if (truths > 0) {
        const JointPositions truth = truth_at(state.stamp_ns);
        for (std::size_t j = 0; j < kJoints; ++j)
          recording.samples(r, static_cast<Eigen::Index>(j)) = truth[j];
      }
      for (std::size_t i = 0; i < core::kCatalogueSize; ++i) {
        recording.samples(r, static_cast<Eigen::Index>(truths + i)) =
            state.values[i] * core::find_unit(core::catalogue()[i].message_unit)->to_si;
      }
    }
    put_relative_time(recording, truths + core::catalogue_index(core::RavenField::kTime, 0));
    return recording;
  }

  /// The authors train on the time since the start; the stamp itself counts from 1970.
  void put_relative_time(Recording& recording, std::size_t column) {
    const std::int64_t origin_ns = states_.front().stamp_ns;
    recording.meta["origin.time"] = fmt::format("{}", 1e-9 * static_cast<double>(origin_ns));
    for (std::size_t row = 0; row < states_.size(); ++row) {
      recording.samples(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
          1e-9 * static_cast<double>(states_[row].stamp_ns - origin_ns);
    }
  }

  /// Times rise from call to call.
  JointPositions truth_at(std::int64_t t_ns) {
    const JointPositions lost = {kLost, kLost, kLost};
    while (next_truth_ < truth_t_ns_.size() && truth_t_ns_[next_truth_] < t_ns) ++next_truth_;
    if (next_truth_ == truth_t_ns_.size()) return lost;
    const std::int64_t after_ns = truth_t_ns_[next_truth_];
    if (after_ns == t_ns) return truth_[next_truth_];
    if (next_truth_ == 0) return lost;
    const std::int64_t before_ns = truth_t_ns_[next_truth_ - 1];
    if (after_ns - before_ns > kLongestGapNs) return lost;
    const double share =
        static_cast<double>(t_ns - before_ns) / static_cast<double>(after_ns - before_ns);
    JointPositions position{};
    for (std::size_t j = 0; j < kJoints; ++j) {
      const double before = truth_[next_truth_ - 1][j];
      position[j] = before + (truth_[next_truth_][j] - before) * share;
    }
    return position;
  }

  std::filesystem::path path_;
  std::vector<BagTopic> topics_;
  const Profile& profile_;
  bool gold_;
  bool skip_bad_;
  std::vector<std::int64_t> truth_t_ns_;
  std::vector<JointPositions> truth_;
  std::size_t next_truth_ = 0;
  std::vector<RavenStateMessage> states_;
  std::vector<Event> drops_;
};

}  // namespace

core::Result<Recording> load_bag(const std::filesystem::path& path, const Profile& profile,
                                 const LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<BagTopic> topics, bag_topics(path));
  return BagLoader(path, std::move(topics), profile, options.skip_bad).load();
}

}  // namespace ravencal::record
