// SPDX-License-Identifier: Apache-2.0
//
// Bags of ROS 2 in which several publishers share a topic, and messages of controllers.
#include <gtest/gtest.h>

#include <cmath>

#include "exchange/joint_states.hpp"
#include "unit/ros2_message.hpp"

namespace ravencal::test {
namespace {

constexpr int kRows = 60;
const std::string kTopic = "/joint_states";

class ExchangeJoints : public ::testing::Test {
 protected:
  ExchangeJoints() { add_topic(1, kTopic, "sensor_msgs/msg/JointState"); }

  void add_topic(std::uint64_t id, const std::string& name, const std::string& type) {
    topics_.add_topic(id, name, type, "cdr");
  }
  void add(const std::string& message, std::uint64_t id = 1) {
    const auto status = topics_.add_message(id, 0, bytes_of(message));
    ASSERT_TRUE(status.ok()) << status.error().message;
  }
  /// An arm of two joints every 8 ms: position k and -k, velocity 10 k, effort 20 k.
  void add_arm(int k) {
    const double value = k;
    add(joint_state(kStart + k * 8 * kMs, {"lift", "swing"}, {value, -value},
                    {10 * value, -10 * value}, {20 * value, -20 * value}));
  }
  record::Table table() {
    auto table = std::move(topics_).table();
    EXPECT_TRUE(table.ok()) << table.error().message;
    return table.ok() ? *table : record::Table();
  }

  exchange::JointStateTopics topics_{"t.mcap", false};
};

void expect_rows_of_the_arm(const record::Table& table) {
  ASSERT_EQ(table.t_ns.size(), static_cast<std::size_t>(kRows));
  for (int k = 0; k < kRows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    EXPECT_EQ(table.t_ns[row], kStart + k * 8 * kMs);
    EXPECT_EQ(values_of(table, kTopic + "/lift/position")[row], k);
    EXPECT_EQ(values_of(table, kTopic + "/swing/velocity")[row], -10 * k);
    EXPECT_EQ(values_of(table, kTopic + "/swing/effort")[row], -20 * k);
  }
  EXPECT_EQ(table.columns[0].name, kTopic + "/lift/position");
}

TEST_F(ExchangeJoints, OfALateSlowGripperMakeNoHolesInTheRowsOfTheArm) {
  for (int k = 0; k < kRows; ++k) {
    add_arm(k);
    if (k % 3 == 0 && k > 0) add(joint_state(kStart + (8 * k - 15) * kMs, {"jaw"}, {0.5 * k}));
  }
  const record::Table read = table();
  expect_rows_of_the_arm(read);
  EXPECT_NEAR(values_of(read, kTopic + "/jaw/position")[10], 0.5 * (10 + 15.0 / 8), 1e-9);
  EXPECT_EQ(read.note,
            "a row for each of the 60 messages of /joint_states with lift, swing; interpolated at "
            "these rows: /joint_states of jaw (19 messages)");
}

TEST_F(ExchangeJoints, OfAFastGripperWithAsManyFingersLeaveTheArmItsRate) {
  for (int k = 0; k < kRows; ++k) {
    for (int i = 0; i < 4; ++i)
      add(joint_state(kStart + (8 * k + 2 * i) * kMs + 7, {"left", "right"}, {1.0, 2.0 + i}));
    add_arm(k);
  }
  expect_rows_of_the_arm(table());
}

TEST_F(ExchangeJoints, OfARareMessageWithMoreJointsGiveNoRows) {
  add(joint_state(kStart - kMs, {"a", "b", "c"}, {1.0, 2.0, 3.0}));
  add(joint_state(kStart - kMs, {"lift", "swing", "jaw"}, {1.0, 2.0, 3.0}));
  for (int k = 0; k < kRows; ++k) add_arm(k);
  const record::Table read = table();
  expect_rows_of_the_arm(read);
  EXPECT_TRUE(read.left_out.contains("/joint_states of lift, swing, jaw"));
  EXPECT_NE(read.note.find("left out: /joint_states of lift, swing, jaw"), std::string::npos);
}

TEST_F(ExchangeJoints, InOtherOrderAndWithoutVelocitiesBindByName) {
  for (int k = 0; k < kRows; ++k) {
    if (k % 2 == 0) {
      add_arm(k);
    } else {
      const double value = k;
      add(joint_state(kStart + k * 8 * kMs, {"swing", "lift"}, {-value, value}));
    }
  }
  const record::Table read = table();
  ASSERT_EQ(read.t_ns.size(), static_cast<std::size_t>(kRows));
  EXPECT_EQ(values_of(read, kTopic + "/lift/position")[7], 7);
  EXPECT_EQ(values_of(read, kTopic + "/swing/position")[7], -7);
  EXPECT_TRUE(std::isnan(values_of(read, kTopic + "/lift/velocity")[7]));
  EXPECT_EQ(values_of(read, kTopic + "/lift/velocity")[8], 80);
  EXPECT_EQ(read.note, "");
}

TEST_F(ExchangeJoints, OneAMessageMakeARowForEachSweep) {
  for (const std::int64_t apart_ns : {std::int64_t{0}, kMs / 10, 2 * kMs, 7 * kMs / 2}) {
    SCOPED_TRACE(apart_ns);
    topics_ = exchange::JointStateTopics("t.mcap", false);
    add_topic(1, kTopic, "sensor_msgs/msg/JointState");
    for (int k = 0; k < kRows; ++k) {
      const std::int64_t t_ns = kStart + k * 8 * kMs + (k % 5) * kMs / 8;
      add(joint_state(t_ns, {"lift"}, {1.0 * k}, {2.0 * k}));
      if (k != 20) add(joint_state(t_ns + apart_ns, {"swing"}, {3.0 * k}, {4.0 * k}));
      add(joint_state(t_ns + 2 * apart_ns, {"reach"}, {5.0 * k}, {6.0 * k}));
      for (int i = 0; i < 3; ++i) add(joint_state(t_ns + i * kMs, {"jaw"}, {0.1}));
    }
    const record::Table read = table();
    ASSERT_EQ(read.t_ns.size(), static_cast<std::size_t>(kRows));
    for (std::size_t row = 0; row < read.t_ns.size(); ++row) {
      const auto k = static_cast<double>(row);
      EXPECT_EQ(values_of(read, kTopic + "/lift/velocity")[row], 2 * k);
      EXPECT_EQ(values_of(read, kTopic + "/reach/position")[row], 5 * k);
      const double swing = values_of(read, kTopic + "/swing/position")[row];
      if (row == 20) {
        EXPECT_TRUE(std::isnan(swing));
      } else {
        EXPECT_EQ(swing, 3 * k);
      }
    }
    EXPECT_NE(read.note.find("with lift; of the same sweep: swing, reach; interpolated"),
              std::string::npos)
        << read.note;
  }
}

TEST_F(ExchangeJoints, ThatRepeatAStampAreLeftOut) {
  for (int k = 0; k < kRows; ++k) {
    add_arm(k);
    if (k % 4 == 3) add_arm(k - 1);
  }
  const record::Table read = table();
  expect_rows_of_the_arm(read);
  EXPECT_NE(read.note.find("15 messages repeat a stamp"), std::string::npos) << read.note;
}

/// control_msgs/msg/JointTrajectoryControllerState of so many points; point i has the positions
/// 100 i + k and 100 i - k, and no velocities where `positions_only`.
std::string controller_state(std::size_t points, int k, bool positions_only = false) {
  CdrWriter message(kStart + k * 16 * kMs, {"swing", "lift"});
  for (std::size_t i = 0; i < points; ++i) {
    const double base = 100.0 * static_cast<double>(i % 4);
    message.numbers({base - k, base + k});
    message.numbers(positions_only ? std::vector<double>() : std::vector{base, base + 1});
    message.numbers({}).numbers({}).number(std::int32_t{1}).number(std::uint32_t{2});
  }
  message.texts({"base"});
  for (std::size_t i = 0; i < points; ++i) {
    message.number(std::uint32_t{1});
    for (int n = 0; n < 7; ++n) message.number(0.25 * n);
    message.number(std::uint32_t{0}).number(std::uint32_t{0});
    message.number(std::int32_t{0}).number(std::uint32_t{0});
  }
  return message.bytes();
}

TEST_F(ExchangeJoints, OfAControllerHaveOneSetOfNamesWhateverItsVersion) {
  const std::string type = "control_msgs/msg/JointTrajectoryControllerState";
  for (const std::size_t points : {3U, 4U, 6U}) {
    for (const bool positions_only : {false, true}) {
      SCOPED_TRACE(points);
      topics_ = exchange::JointStateTopics("t.mcap", false);
      add_topic(1, "/arm_controller/state", type);
      for (int k = 0; k < 12; ++k) add(controller_state(points, k, positions_only));
      const record::Table read = table();
      ASSERT_EQ(read.t_ns.size(), 12U);
      const std::string lift = "/arm_controller/state/lift/";
      EXPECT_EQ(values_of(read, lift + "reference/position")[5], 5);
      EXPECT_EQ(values_of(read, lift + "actual/position")[5], 105);
      EXPECT_EQ(values_of(read, lift + "error/position")[5], 205);
      if (points > 3) {
        EXPECT_EQ(values_of(read, lift + "command/position")[5], 305);
      }
      if (!positions_only) {
        EXPECT_EQ(values_of(read, lift + "actual/velocity")[5], 101);
      }
      EXPECT_EQ(read.columns.size(), 2 * (points == 3 ? 3U : 4U) * (positions_only ? 1U : 2U));
      EXPECT_EQ(read.columns[0].words, "swing/reference/position");
    }
  }
}

TEST_F(ExchangeJoints, OfAControllerThatAreCutShortAreRefused) {
  const std::string whole = controller_state(4, 3);
  std::size_t read = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto message = exchange::decode_joint_message(
        exchange::JointMessageType::kControllerState, bytes_of(whole.substr(0, size)));
    if (!message.ok()) continue;
    ++read;
    EXPECT_EQ(message->values.size(), 12U) << "no whole message of three points";
  }
  EXPECT_LE(read, 4U) << "more than that message and what fills it up";
}

/// control_msgs/msg/DynamicJointState: position of both joints, temperature of the first.
std::string dynamic_joint_state(std::int64_t t_ns, double value) {
  CdrWriter message(t_ns, {"lift", "swing"});
  message.number(std::uint32_t{2});
  message.texts({"temperature", "position"}).numbers({30 + value, value});
  message.texts({"position"}).numbers({-value});
  return message.bytes();
}

TEST_F(ExchangeJoints, OfADynamicStateHaveAColumnForEachInterface) {
  const std::string type = "control_msgs/msg/DynamicJointState";
  topics_ = exchange::JointStateTopics("t.mcap", false);
  add_topic(1, "/dyn", type);
  for (int k = 0; k < 12; ++k) add(dynamic_joint_state(kStart + k * 8 * kMs, k));
  const record::Table read = table();
  ASSERT_EQ(read.columns.size(), 3U);
  EXPECT_EQ(values_of(read, "/dyn/lift/temperature")[4], 34);
  EXPECT_EQ(values_of(read, "/dyn/swing/position")[4], -4);
  std::string uneven = CdrWriter(kStart, {"lift", "swing"}).number(std::uint32_t{1}).bytes();
  uneven += std::string(64, '\0');
  const auto refused = exchange::decode_joint_message(
      exchange::JointMessageType::kDynamicJointState, bytes_of(uneven));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message, "it has 2 names and interfaces of 1");
}

TEST_F(ExchangeJoints, OfOtherTypesOfMessageDoNotRepeatWhatAJointStateSays) {
  add_topic(2, "/dyn", "control_msgs/msg/DynamicJointState");
  add_topic(3, "/ctl", "control_msgs/msg/JointTrajectoryControllerState");
  for (int k = 0; k < kRows; ++k) {
    add(dynamic_joint_state(kStart + k * 8 * kMs, k), 2);
    if (k % 2 == 0) add(controller_state(4, k / 2), 3);
    add_arm(k);
  }
  const record::Table read = table();
  expect_rows_of_the_arm(read);
  EXPECT_EQ(values_of(read, "/dyn/lift/temperature")[9], 39);
  EXPECT_EQ(values_of(read, "/ctl/lift/reference/position")[9], 4.5);
  EXPECT_EQ(read.left_out.at("/dyn/lift/position"), "it repeats /joint_states/lift/position");
  EXPECT_EQ(read.left_out.at("/ctl/lift/actual/velocity"),
            "it repeats /joint_states/lift/velocity");
}

}  // namespace
}  // namespace ravencal::test
