// SPDX-License-Identifier: Apache-2.0
//
// raven_state and JointState as bytes: the definition by its checksum, every value both ways.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "record/raven_state_message.hpp"

namespace ravencal::record {
namespace {

using core::RavenField;

std::string md5_of(const std::string& text) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  EVP_Digest(text.data(), text.size(), digest, &length, EVP_md5(), nullptr);
  std::string hex;
  for (unsigned i = 0; i < length; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

/// ROS's rule (genmsg): the fields as "type name" lines without comments and needless blanks, a
/// message type replaced by its own checksum.
std::string md5_by_ros_rule(std::string_view definition) {
  std::istringstream lines{std::string(definition)};
  std::vector<std::string> texts(1);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("====")) {
      texts.emplace_back();
      std::getline(lines, line);  // MSG: std_msgs/Header
      continue;
    }
    std::istringstream words(line.substr(0, line.find('#')));
    std::string type;
    std::string name;
    if (!(words >> type >> name)) continue;
    texts.back() += (texts.back().empty() ? "" : "\n") + type + " " + name;
  }
  std::string text = texts.at(0);
  if (const auto header = text.find("Header "); header != std::string::npos)
    text.replace(header, 6, md5_of(texts.at(1)));
  return md5_of(text);
}

TEST(RavenState, HasTheChecksumThatTheRobotPublishes) {
  EXPECT_EQ(raven_state_type().md5, "ce9e7f4969049d8bb365de3c98461a01");
  EXPECT_EQ(md5_by_ros_rule(raven_state_type().definition), raven_state_type().md5);
  EXPECT_EQ(md5_by_ros_rule(joint_state_type().definition), joint_state_type().md5);
}

RavenStateMessage any_state(unsigned seed) {
  std::mt19937 generator(seed);
  RavenStateMessage state;
  state.stamp_ns = 1'700'000'000'123'456'789;
  state.dt_ns = 1'000'123;
  for (double& value : state.values)
    value = static_cast<float>(std::uniform_int_distribution<int>(-100'000, 100'000)(generator));
  state.values[core::catalogue_index(RavenField::kTime, 0)] = 1e-9 * 1'700'000'000'123'456'789;
  return state;
}

TEST(RavenState, IsReadAsItWasWrittenWhicheverArmIsCalibrated) {
  for (const bool gold : {true, false}) {
    const RavenStateMessage state = any_state(7);
    const auto bytes = encode_raven_state(state, gold);
    EXPECT_EQ(bytes.size(), 980U) << "as published, with an empty frame_id";
    const auto again = decode_raven_state(bytes, gold);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->stamp_ns, state.stamp_ns);
    EXPECT_EQ(again->dt_ns, state.dt_ns);
    EXPECT_EQ(again->values, state.values);
  }
}

TEST(RavenState, SwapsTheHalvesForTheOtherArm) {
  const RavenStateMessage state = any_state(8);
  const auto other = decode_raven_state(encode_raven_state(state, true), false);
  ASSERT_TRUE(other);
  for (const auto field : {RavenField::kJpos, RavenField::kEncVals, RavenField::kGraspD}) {
    EXPECT_EQ(other->values[core::catalogue_index(field, 0, true)],
              state.values[core::catalogue_index(field, 0)]);
    EXPECT_EQ(other->values[core::catalogue_index(field, 0)],
              state.values[core::catalogue_index(field, 0, true)]);
  }
  EXPECT_EQ(other->values[core::catalogue_index(RavenField::kRunlevel, 0)],
            state.values[core::catalogue_index(RavenField::kRunlevel, 0)]);
}

TEST(RavenState, RefusesEveryOtherLength) {
  auto bytes = encode_raven_state(any_state(9), true);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(decode_raven_state(std::span(bytes).first(n), true)) << n;
  bytes.push_back(0);
  EXPECT_FALSE(decode_raven_state(bytes, true));
}

TEST(JointState, IsReadAsItWasWrittenAndRefusedWhenCutOrWild) {
  const JointStateMessage message{12'345'678'901, {"shoulder", "elbow"}, {1.5, -2.5}, {}};
  auto bytes = encode_joint_state(message);
  const auto again = decode_joint_state(bytes);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->stamp_ns, message.stamp_ns);
  EXPECT_EQ(again->names, message.names);
  EXPECT_EQ(again->positions, message.positions);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(decode_joint_state(std::span(bytes).first(n))) << n;
  // A length that would need more memory than there is bytes for.
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto wild = bytes;
    wild[i] = 0xFF;
    (void)decode_joint_state(wild);
  }
}

}  // namespace
}  // namespace ravencal::record
