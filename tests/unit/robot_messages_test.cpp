// SPDX-License-Identifier: Apache-2.0
//
// The controller's CRTK messages as bytes: written messages read back unchanged, and bytes from a
// network are checked, then read or refused.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "ros/messages.hpp"

namespace ravencal::ros_io {
namespace {

constexpr std::size_t kStampBytes = 12;  // seq and stamp
constexpr std::int64_t kLastStampS = 4'294'967'295;

RC_GTEST_PROP(RobotMessages, OperatingStatesAreReadAsTheyWereWritten, (bool homed, bool busy)) {
  OperatingStateMessage message;
  message.stamp_ns = *rc::gen::inRange<std::int64_t>(0, kLastStampS) * 1'000'000'000;
  message.state = *rc::gen::arbitrary<std::string>();
  message.is_homed = homed;
  message.is_busy = busy;
  const auto read = decode_operating_state(encode_operating_state(message));
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->stamp_ns == message.stamp_ns);
  RC_ASSERT(read->state == message.state);
  RC_ASSERT(read->is_homed == homed);
  RC_ASSERT(read->is_busy == busy);
}

RC_GTEST_PROP(RobotMessages, StringsAreReadAsTheyWereWritten, (const std::string& text)) {
  const auto read = decode_string_stamped(encode_string_stamped({7, text}));
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->text == text);
}

RC_GTEST_PROP(RobotMessages, AnyBytesAreReadOrRefused, (const std::vector<std::uint8_t>& bytes)) {
  const auto state = decode_operating_state(bytes);
  if (state) RC_ASSERT(bytes.size() >= kStampBytes + 4 + state->state.size() + 4 + 2);
  (void)decode_string_stamped(bytes);
}

RC_GTEST_PROP(RobotMessages, AMessageThatIsCutOffIsRefused, (const std::string& text)) {
  std::vector<std::uint8_t> bytes = encode_string_stamped({1, text});
  bytes.resize(*rc::gen::inRange<std::size_t>(0, bytes.size()));
  RC_ASSERT(!decode_string_stamped(bytes).has_value());
}

TEST(RobotMessages, APoseIsATranslationAndAUnitQuaternion) {
  PoseMessage pose;
  pose.position_m = {0.1, -0.2, 0.3};
  pose.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // a quarter turn about z
  const auto bytes = encode_transform_stamped(pose);
  double values[7];
  std::memcpy(values, bytes.data() + bytes.size() - sizeof values, sizeof values);
  const double expected[7] = {0.1, -0.2, 0.3, 0.0, 0.0, std::sqrt(0.5), std::sqrt(0.5)};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(values[i], expected[i], 1e-12);
}

}  // namespace
}  // namespace ravencal::ros_io
