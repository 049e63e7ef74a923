// SPDX-License-Identifier: Apache-2.0
//
// Bags of ROS 2. tests/golden/ros2/joint_states_{zstd,lz4}.mcap were written by foxglove's Python
// packages mcap 1.4.0 and mcap-ros2-support 0.5.8, joint_states.db3 by Ternaris' Python package
// rosbags: 40 messages of /joint_states every 10 ms (shoulder 0.01 k, elbow -0.02 k), /encoders
// without stamps at every second of them 5 ms later (shoulder 0.01 k + 0.005), none of messages 10
// to 25, and /note of another type.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/whole_file.hpp"
#include "exchange/joint_states.hpp"
#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "unit/ros2_message.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

const fs::path kBags = fs::path(RAVENCAL_SOURCE_DIR) / "tests/golden/ros2";

class ExchangeRos2 : public ::testing::Test {
 protected:
  ExchangeRos2() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ExchangeRos2() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  fs::path folder_ =
      fs::temp_directory_path() / fmt::format("ravencal_exchange_ros2_test_{}", ::getpid());
};

class ExchangeBag : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Written, ExchangeBag,
                         ::testing::Values("joint_states_zstd.mcap", "joint_states_lz4.mcap",
                                           "joint_states.db3"),
                         [](const auto& file) {
                           std::string name = file.param;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST_P(ExchangeBag, OfOthersGivesAColumnForEveryJointAndQuantity) {
  const auto table = exchange::read_table(kBags / GetParam());
  ASSERT_TRUE(table.ok()) << table.error().message;
  ASSERT_EQ(table->columns.size(), 6U);
  ASSERT_EQ(table->t_ns.size(), 40U);
  EXPECT_EQ(table->t_ns[0], kStart);
  EXPECT_EQ(table->t_ns[39], kStart + 390 * kMs);
  EXPECT_EQ(values_of(*table, "/joint_states/elbow/position")[7], -0.02 * 7);
  EXPECT_EQ(values_of(*table, "/joint_states/elbow/velocity")[39], -2.0);
  EXPECT_EQ(values_of(*table, "/encoders/shoulder/effort")[3], 7.0);
  EXPECT_NE(table->left_out.at("/note").find("std_msgs/msg/String"), std::string::npos);
}

TEST_P(ExchangeBag, InterpolatesSlowerTopicsButNotAcrossAnOutage) {
  const auto table = exchange::read_table(kBags / GetParam());
  ASSERT_TRUE(table.ok()) << table.error().message;
  const std::vector<double>& encoder = values_of(*table, "/encoders/shoulder/position");
  for (std::size_t k = 0; k < encoder.size(); ++k) {
    SCOPED_TRACE(k);
    const bool has_neighbours = (k >= 1 && k <= 8) || (k >= 27 && k <= 38);
    if (has_neighbours) {
      EXPECT_NEAR(encoder[k], 0.01 * static_cast<double>(k), 1e-12);
    } else {
      EXPECT_TRUE(std::isnan(encoder[k]));
    }
  }
}

TEST_P(ExchangeBag, IsReadThroughAProfile) {
  const fs::path profile =
      fs::temp_directory_path() / fmt::format("ravencal_ros2_profile_{}.toml", ::getpid());
  std::ofstream(profile) << R"([source]
robot = "two joints"
[[channel]]
name = "estimate.shoulder"
column = "/joint_states/shoulder/position"
unit = "rad"
role = "joint_estimate"
joint = "shoulder"
[[channel]]
name = "truth.shoulder"
column = "/encoders/shoulder/position"
unit = "deg"
scale = 2
role = "joint_truth"
joint = "shoulder"
may_be_missing = true
)";
  record::LoadOptions options;
  options.profile = profile.string();
  options.range.to_s = 0.2;
  const auto recording = exchange::load_recording(kBags / GetParam(), options);
  fs::remove(profile);
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  ASSERT_EQ(recording->rows(), 20);
  EXPECT_EQ(recording->t_ns[3], kStart + 30 * kMs);
  EXPECT_DOUBLE_EQ(recording->samples(3, 0), 0.03);
  EXPECT_NEAR(recording->samples(3, 1), 0.06 * M_PI / 180.0, 1e-15);
  EXPECT_EQ(recording->calibratable_joints(), std::vector<std::string>{"shoulder"});
}

/// Topic /a every `period_ms`, /b of one value at 0 ms and one at `gap_ms`, which is read half way.
double half_way(std::int64_t other_period_ms, std::int64_t gap_ms) {
  exchange::JointStateTopics topics("t.mcap", false);
  topics.add_topic(1, "/a", "sensor_msgs/msg/JointState", "cdr");
  topics.add_topic(2, "/b", "sensor_msgs/msg/JointState", "cdr");
  const auto add = [&](std::uint64_t topic, std::int64_t t_ns, double value) {
    EXPECT_TRUE(topics.add_message(topic, 0, bytes_of(joint_state(t_ns, {"j"}, {value}))).ok());
  };
  for (int i = 0; i < 40; ++i) add(1, kStart + gap_ms * kMs / 2 + i, 0.0);
  std::int64_t t_ns = kStart - 10 * other_period_ms * kMs;
  for (; t_ns <= kStart; t_ns += other_period_ms * kMs) add(2, t_ns, 1.0);
  for (int i = 0; i < 5; ++i) add(2, kStart + (gap_ms + i * other_period_ms) * kMs, 3.0);
  const auto table = std::move(topics).table();
  EXPECT_TRUE(table.ok());
  return values_of(*table, "/b/j/position").front();
}

TEST(ExchangeJointStates, AreInterpolatedAcrossFivePeriodsOrFiftyMilliseconds) {
  EXPECT_EQ(half_way(1, 40), 2.0);
  EXPECT_TRUE(std::isnan(half_way(1, 60)));
  EXPECT_EQ(half_way(100, 400), 2.0);
  EXPECT_TRUE(std::isnan(half_way(100, 600)));
}

core::Result<exchange::JointMessage> decode(std::span<const std::uint8_t> bytes) {
  return exchange::decode_joint_message(exchange::JointMessageType::kJointState, bytes);
}

TEST(ExchangeJointStates, MayBeBigEndianAndLeaveQuantitiesOut) {
  const std::string big(
      "\0\0\0\0\0\0\0\5\0\0\0\7\0\0\0\1\0\0\0\0\0\0\0\1\0\0\0\2j\0\0\0\0\0\0\1"
      "\x3F\xF8\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
      52);
  const auto state = decode(bytes_of(big));
  ASSERT_TRUE(state.ok()) << state.error().message;
  EXPECT_EQ(state->stamp_ns, 5'000'000'007);
  EXPECT_EQ(state->names, std::vector<std::string>{"j"});
  ASSERT_EQ(state->values.size(), 1U);
  EXPECT_EQ(state->values[0].quantity, "position");
  EXPECT_EQ(state->values[0].value, 1.5);
}

TEST(ExchangeJointStates, ThatAreCutShortOrClaimTooMuchAreRefused) {
  const std::string whole = joint_state(kStart, {"left", "right"}, {1.0, 2.0});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(decode(bytes_of(whole.substr(0, size))).ok()) << size;
  }
  std::string many = whole;
  many.replace(4 + 8 + 12, 4, "\xFF\xFF\xFF\xFF");  // names; behind stamp and frame
  EXPECT_FALSE(decode(bytes_of(many)).ok());
  const auto uneven = decode(bytes_of(joint_state(0, {"j"}, {1.0, 2.0})));
  EXPECT_EQ(uneven.error().message, "it has 1 names and 2 values");
}

TEST(ExchangeJointStates, OutOfOrderAreRefusedOrLeftOut) {
  for (const bool skip_bad : {false, true}) {
    exchange::JointStateTopics topics("t.mcap", skip_bad);
    topics.add_topic(1, "/a", "sensor_msgs/msg/JointState", "cdr");
    ASSERT_TRUE(topics.add_message(1, 0, bytes_of(joint_state(5 * kMs, {"j"}, {1.0}))).ok());
    const auto late = topics.add_message(1, 0, bytes_of(joint_state(3 * kMs, {"j"}, {2.0})));
    EXPECT_EQ(late.ok(), skip_bad);
    if (!late.ok()) {
      EXPECT_EQ(late.error().message,
                "t.mcap: /a, message 2: its stamp is 2.000 ms before the last one's; --skip-bad "
                "leaves it out");
    } else {
      const auto table = std::move(topics).table();
      EXPECT_EQ(table->t_ns.size(), 1U);
      EXPECT_EQ(table->events.size(), 1U);
    }
  }
}

TEST_F(ExchangeRos2, AKilledRecorderIsReadUpToTheDamageOnlyIfAsked) {
  const auto whole = core::read_whole_file(kBags / "joint_states_zstd.mcap");
  ASSERT_TRUE(whole.ok());
  record::LoadOptions skip;
  skip.skip_bad = true;
  std::size_t most_rows = 0;
  for (std::size_t size = 8; size < whole->size() - 60; size += 173) {
    SCOPED_TRACE(size);
    const fs::path path = write("cut.mcap", whole->substr(0, size));
    const auto refused = exchange::read_table(path);
    ASSERT_FALSE(refused.ok()) << "a file without footer was read";
    EXPECT_NE(refused.error().message.find(path.string() + ": ends without a footer, in the record"
                                                           " at byte "),
              std::string::npos)
        << refused.error().message;
    const auto read = exchange::read_table(path, skip);
    if (!read.ok()) {
      EXPECT_NE(read.error().message.find("holds no message"), std::string::npos);
      continue;
    }
    EXPECT_GE(read->t_ns.size(), most_rows);
    most_rows = read->t_ns.size();
    EXPECT_EQ(read->events.back().kind, "drop");
  }
  EXPECT_EQ(most_rows, 40U);
}

TEST_F(ExchangeRos2, ADamagedChunkIsNamedAndLeftOutIfAsked) {
  auto bytes = core::read_whole_file(kBags / "joint_states_lz4.mcap");
  ASSERT_TRUE(bytes.ok());
  const std::size_t chunk = bytes->find("lz4");
  ASSERT_NE(chunk, std::string::npos);
  (*bytes)[chunk + 60] = static_cast<char>((*bytes)[chunk + 60] ^ 0x55);
  const fs::path path = write("hurt.mcap", *bytes);
  const auto refused = exchange::read_table(path);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find(": the record at byte "), std::string::npos)
      << refused.error().message;
  record::LoadOptions skip;
  skip.skip_bad = true;
  const auto read = exchange::read_table(path, skip);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_LT(read->t_ns.size(), 40U);
  EXPECT_GT(read->t_ns.size(), 20U);
}

TEST_F(ExchangeRos2, CompressedMessagesOfRosbag2AreRefusedWithTheRemedy) {
  fs::copy_file(kBags / "joint_states.db3", folder_ / "c.db3");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "c.db3").c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "UPDATE messages SET data = x'28B52FFD0000'", nullptr, nullptr,
                         nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  const auto refused = exchange::read_table(folder_ / "c.db3");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("ros2 bag convert"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::test
