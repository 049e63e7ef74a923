// SPDX-License-Identifier: Apache-2.0
#include "ros/robot_topics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/catalogue.hpp"
#include "core/constants.hpp"
#include "core/joint_layout.hpp"
#include "ros/messages.hpp"

namespace ravencal::ros_io {
namespace {

using core::RavenField;

constexpr double kMetresPerMicrometre = 1e-6;
constexpr std::uint32_t kStateQueue = 1000;
constexpr std::array<std::size_t, 7> kCrtkSlots = {0, 1, 2, 4, 5, 6, 7};
constexpr std::size_t kArms = 2;
// CRTK's base frames by mechanism, not by arm (crtk_motion_api.cpp, T_crtk_in_r0_gold and _green),
// row-major, and the frame of setpoint_cp, which has none (local_io.cpp).
using Frame = std::array<double, 9>;
constexpr std::array<Frame, kArms> kBaseOfMechanism = {
    {{0, -1, 0, 0, 0, -1, 1, 0, 0}, {0, 1, 0, 0, 0, 1, 1, 0, 0}}};
constexpr Frame kNoBase = {1, 0, 0, 0, 1, 0, 0, 0, 1};
// local_io.cpp: arm1's joints are called gold whichever arm they are.
constexpr std::array<const char*, kArms> kPrefixes = {"gold_", "green_"};
constexpr std::array<const char*, 7> kJointNames = {"shoulder", "elbow", "ins", "roll",
                                                    "wrist",    "jaw1",  "jaw2"};

double value_of(const robot::CycleOutput& output, RavenField field, std::size_t element,
                bool other) {
  return output.message[core::catalogue_index(field, element, other)];
}

/// Named joints of topic arm1 (0) or arm2 (1), all zero.
record::JointStateMessage joints_at_zero(std::size_t topic, std::int64_t stamp_ns) {
  record::JointStateMessage message;
  message.stamp_ns = stamp_ns;
  for (const char* joint : kJointNames)
    message.names.push_back(fmt::format("{}{}", kPrefixes[topic], joint));
  message.positions.assign(kJointNames.size(), 0.0);
  message.velocities.assign(kJointNames.size(), 0.0);
  return message;
}

/// Measured joints in CRTK's order, SI: raven_state has degrees, and metres times 180/pi.
record::JointStateMessage joints_of(const robot::CycleOutput& output, std::size_t topic, bool other,
                                    std::int64_t stamp_ns) {
  record::JointStateMessage message = joints_at_zero(topic, stamp_ns);
  for (std::size_t i = 0; i < kCrtkSlots.size(); ++i) {
    const std::size_t slot = kCrtkSlots[i];
    message.positions[i] = value_of(output, RavenField::kJpos, slot, other) * core::kRadPerDeg;
    message.velocities[i] = value_of(output, RavenField::kJvel, slot, other) * core::kRadPerDeg;
  }
  return message;
}

/// Pose in frame `base`. `other`: whether it stands in the other arm's slots.
PoseMessage pose_of(const robot::CycleOutput& output, RavenField position, RavenField rotation,
                    bool other, const Frame& base, std::int64_t stamp_ns) {
  PoseMessage message;
  message.stamp_ns = stamp_ns;
  message.rotation.fill(0.0);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double factor = base[3 * row + k];
      message.position_m[row] +=
          factor * value_of(output, position, k, other) * kMetresPerMicrometre;
      for (std::size_t column = 0; column < 3; ++column) {
        message.rotation[3 * row + column] +=
            factor * value_of(output, rotation, 3 * k + column, other);
      }
    }
  }
  return message;
}

/// A topic without subscribers is not encoded.
template <typename Encode>
void offer(ros::Publisher& publisher, const record::RosMessageType& type, Encode&& encode) {
  if (publisher.getNumSubscribers() > 0) publish(publisher, type, encode());
}

}  // namespace

RobotTopics::RobotTopics(ros::NodeHandle& node, MasterWatch& watch, const physics::Plant& plant,
                         bool encoders, std::int64_t start_ns)
    : gold_(plant.robot.arm == "gold"),
      encoders_(encoders),
      start_ns_(start_ns),
      reading_period_ns_(std::llround(1e9 * plant.logger.truth_period_s)),
      reading_latency_ns_(std::llround(1e9 * plant.logger.truth_latency_s)) {
  ravenstate_ = make(node, watch, "/ravenstate", record::raven_state_type());
  operating_state_ = make(node, watch, "/operating_state", operating_state_type());
  for (std::size_t arm = 0; arm < arms_.size(); ++arm) {
    const std::string name = fmt::format("/arm{}/", arm + 1);
    ArmTopics& topics = arms_[arm];
    topics.operating_state = make(node, watch, name + "operating_state", operating_state_type());
    topics.measured_js = make(node, watch, name + "measured_js", record::joint_state_type());
    topics.setpoint_js = make(node, watch, name + "setpoint_js", record::joint_state_type());
    topics.measured_cp = make(node, watch, name + "measured_cp", transform_stamped_type());
    topics.setpoint_cp = make(node, watch, name + "setpoint_cp", transform_stamped_type());
  }
  if (!encoders_) return;
  ext_jpos_ = make(node, watch, "/ext_jpos", record::joint_state_type());
  joint_enc_ = make(node, watch, "/joint_enc", record::joint_state_type());
}

ros::Publisher RobotTopics::make(ros::NodeHandle& node, MasterWatch& watch,
                                 const std::string& topic, const record::RosMessageType& type) {
  watch.add_publication(topic, std::string(type.name));
  return advertise(node, topic, type, kStateQueue);
}

void RobotTopics::publish(const robot::CycleOutput& output) {
  const std::int64_t stamp_ns = start_ns_ + output.t_ns;
  publish_state(output, stamp_ns);
  const OperatingStateMessage state{stamp_ns, robot::name_of(output.operating), output.homed,
                                    output.busy};
  const auto encode = [&] { return encode_operating_state(state); };
  offer(operating_state_, operating_state_type(), encode);
  for (std::size_t arm = 0; arm < arms_.size(); ++arm) {
    offer(arms_[arm].operating_state, operating_state_type(), encode);
    publish_arm(output, arm, stamp_ns);
  }
  if (encoders_) publish_encoders(output, stamp_ns);
}

void RobotTopics::publish_state(const robot::CycleOutput& output, std::int64_t stamp_ns) {
  record::RavenStateMessage message;
  message.stamp_ns = stamp_ns;
  message.dt_ns = last_stamp_ns_ == 0 ? 0 : stamp_ns - last_stamp_ns_;
  message.values = output.message;
  last_stamp_ns_ = stamp_ns;
  offer(ravenstate_, record::raven_state_type(),
        [&] { return record::encode_raven_state(message, gold_); });
}

void RobotTopics::publish_arm(const robot::CycleOutput& output, std::size_t arm,
                              std::int64_t stamp_ns) {
  ArmTopics& topics = arms_[arm];
  // measured_js goes by the arm's name, the green one on arm1; measured_cp is crosswise, mech[1] on
  // arm1; setpoint_cp is mech[0] on arm1; and setpoint_js is read where nobody writes it: always
  // zero (local_io.cpp, publish_crtk_*).
  const bool shows_green = arm == 0;
  const bool joints_in_other_slots = shows_green == gold_;
  const std::size_t crosswise = 1 - arm;
  // raven_state keeps mech[0] in the slots of the gold arm, mech[1] in those of the green one.
  const auto in_other_slots = [this](std::size_t mechanism) { return (mechanism == 0) != gold_; };
  offer(topics.measured_js, record::joint_state_type(), [&] {
    return record::encode_joint_state(joints_of(output, arm, joints_in_other_slots, stamp_ns));
  });
  offer(topics.setpoint_js, record::joint_state_type(),
        [&] { return record::encode_joint_state(joints_at_zero(arm, stamp_ns)); });
  offer(topics.measured_cp, transform_stamped_type(), [&] {
    return encode_transform_stamped(pose_of(output, RavenField::kPos, RavenField::kOri,
                                            in_other_slots(crosswise), kBaseOfMechanism[crosswise],
                                            stamp_ns));
  });
  offer(topics.setpoint_cp, transform_stamped_type(), [&] {
    return encode_transform_stamped(pose_of(output, RavenField::kPosD, RavenField::kOriD,
                                            in_other_slots(arm), kNoBase, stamp_ns));
  });
}

/// As the authors' node: a reading every 10 ms or so, stamped when its line has been parsed.
void RobotTopics::publish_encoders(const robot::CycleOutput& output, std::int64_t stamp_ns) {
  if (output.t_ns < next_reading_ns_) return;
  next_reading_ns_ = std::max(next_reading_ns_ + reading_period_ns_, output.t_ns);
  record::JointStateMessage message;
  message.stamp_ns = stamp_ns + reading_latency_ns_;
  for (std::size_t j = 0; j < core::kCalibratedJointCount; ++j)
    message.names.emplace_back(core::kSlotNames[j]);
  message.positions.assign(output.encoders_ji.begin(), output.encoders_ji.end());
  offer(ext_jpos_, record::joint_state_type(), [&] { return record::encode_joint_state(message); });
  message.positions.assign(output.encoder_counts.begin(), output.encoder_counts.end());
  offer(joint_enc_, record::joint_state_type(),
        [&] { return record::encode_joint_state(message); });
}

}  // namespace ravencal::ros_io
