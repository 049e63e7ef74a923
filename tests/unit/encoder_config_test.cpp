// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "quadrature_reader/config.hpp"

namespace ravencal::quadrature_reader {
namespace {

const std::string kSource =
    "[[source]]\nname = \"board\"\nkind = \"gpio\"\nchip = \"/dev/ravencal/encoders\"\n";
const std::string kEncoder =
    "[[encoder]]\njoint = \"shoulder\"\nsource = \"board\"\nline_a = \"SH_A\"\nline_b = 1\n"
    "counts_per_rev = 80000\nzero_counts = 0\n";

std::string error_of(const std::string& text) {
  const auto config = parse_config(text, "encoders.toml");
  return config.ok() ? "" : config.error().message;
}

TEST(EncoderConfig, ReadsScaleSignZeroStopAndLines) {
  const auto config = parse_config(kSource + kEncoder + R"(
sign = -1
line_z = "SH_Z"
index_counts = 80000
bias = "pull-up"
stop = "max"
stop_position_deg = 90
[[encoder]]
joint = "insertion"
source = "board"
line_a = 3
line_b = 4
um_per_count = 5
)",
                                   "encoders.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  ASSERT_EQ(config->encoders.size(), 2U);
  const AxisSettings& shoulder = config->encoders[0].axis;
  EXPECT_DOUBLE_EQ(shoulder.si_per_count, 2.0 * std::numbers::pi / 80'000.0);
  EXPECT_EQ(shoulder.sign, -1);
  EXPECT_EQ(shoulder.zero_counts, 0);
  EXPECT_EQ(shoulder.index->counts_per_rev, 80'000);
  EXPECT_TRUE(config->encoders[0].stop->at_maximum);
  EXPECT_DOUBLE_EQ(config->encoders[0].stop->position_si, std::numbers::pi / 2.0);
  const GpioEncoder& lines = config->sources[0].gpio[0];
  EXPECT_EQ(lines.a.name, "SH_A");
  EXPECT_EQ(lines.b.offset, 1U);
  EXPECT_EQ(lines.bias, Bias::kPullUp);
  EXPECT_EQ(config->encoders[1].axis.unit, "m");
  EXPECT_DOUBLE_EQ(config->encoders[1].axis.si_per_count, 5e-6);
  EXPECT_FALSE(config->encoders[1].axis.zero_counts.has_value());
}

TEST(EncoderConfig, ReadsCanLayoutsAndCanopenNodes) {
  const auto config = parse_config(R"(
[[source]]
name = "bus"
kind = "can"
interface = "can-raven"
heartbeat_timeout_ms = 500
position_timeout_ms = 50
[[encoder]]
joint = "shoulder"
source = "bus"
counts_per_rev = 80000
canopen_node = 5
[[encoder]]
joint = "elbow"
source = "bus"
counts_per_rev = 80000
can_id = 0x1F334455
byte_offset = 2
byte_count = 3
big_endian = true
signed = true
counter_bits = 20
)",
                                   "encoders.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  const auto& can = config->sources[0].can;
  EXPECT_EQ(can[0].id, 0x185U);
  EXPECT_EQ(can[0].byte_count, 4U);
  EXPECT_FALSE(can[0].extended);
  EXPECT_TRUE(can[1].extended);
  EXPECT_EQ(can[1].counter_bits, 20U);
  EXPECT_EQ(config->encoders[0].axis.stale_ns, 50'000'000);
}

TEST(EncoderConfig, ReadsCounterChips) {
  const std::string text = R"(
[[source]]
name = "chip"
kind = "counter"
counter = "/dev/ravencal/counter"
mode = "poll"
poll_hz = 2000
[[encoder]]
joint = "insertion"
source = "chip"
um_per_count = 5
count = 1
counter_bits = 24
)";
  const auto config = parse_config(text, "encoders.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->sources[0].counter_mode, CounterMode::kPoll);
  EXPECT_EQ(config->sources[0].poll_period_ns, 500'000);
  const CounterEncoder& count = config->sources[0].counters[0];
  EXPECT_EQ(count.number, 1U);
  EXPECT_EQ(count.counter_bits, 24U);
  EXPECT_EQ(count.max_counts_per_s, 200'000.0) << "1 m/s";
  EXPECT_NE(error_of(text + "index_counts = 80000\n").find("kind gpio"), std::string::npos);
}

TEST(EncoderConfig, NamesFileLineAndKeyOfEveryMistake) {
  EXPECT_EQ(error_of(kSource + kEncoder + "lines_z = 3\n").rfind("encoders.toml:12:", 0), 0U)
      << error_of(kSource + kEncoder + "lines_z = 3\n");
  EXPECT_NE(
      error_of(kSource + kEncoder + "lines_z = 3\n").find("unknown key 'lines_z' in [[encoder]]"),
      std::string::npos);
  EXPECT_NE(
      error_of(kSource + "colour = 1\n" + kEncoder).find("unknown key 'colour' in [[source]]"),
      std::string::npos);
  EXPECT_NE(error_of(kSource + kEncoder + "sign = 0\n").find("sign must be 1 or -1"),
            std::string::npos);
  EXPECT_NE(error_of(kSource + kEncoder + "um_per_count = 5\n").find("either"), std::string::npos);
  EXPECT_NE(error_of(kSource + kEncoder + "stop = \"max\"\n").find("stop_position_deg"),
            std::string::npos);
  EXPECT_NE(error_of(kSource + kEncoder + kEncoder).find("two encoders"), std::string::npos);
  EXPECT_NE(error_of(kEncoder).find("[[source]]"), std::string::npos);
  EXPECT_NE(error_of(kSource).find("[[encoder]]"), std::string::npos);
  EXPECT_NE(error_of("[[source]\n").find("encoders.toml:1:"), std::string::npos);
  EXPECT_NE(
      error_of(kSource + "[[encoder]]\njoint = \"x\"\nsource = \"other\"\ncounts_per_rev = 4\n")
          .find("'other'"),
      std::string::npos);
  EXPECT_NE(error_of(kSource + kEncoder + "index_counts = 80000\n").find("needs line_z"),
            std::string::npos);
  EXPECT_NE(error_of("source = 3\n").find("[[source]]"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
