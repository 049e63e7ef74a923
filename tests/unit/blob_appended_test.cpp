// SPDX-License-Identifier: Apache-2.0
//
// What version 2.1 appended to a blob's header: origin and loop gains.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

namespace blob = model::blob;
using model::BlobCheck;
using model::BlobStatus;
using model::BlobView;
using Bytes = std::vector<std::byte>;

constexpr const char* kGolden = "weights_v2_1.blob";

void put_at(Bytes& bytes, std::size_t at, std::initializer_list<unsigned> values) {
  for (const unsigned value : values) bytes[at++] = static_cast<std::byte>(value);
}

/// The golden bytes with `more` bytes behind their header, as a later minor version would write.
Bytes with_longer_header(std::size_t more) {
  Bytes newer = golden_bytes(kGolden);
  newer.insert(newer.begin() + blob::kHeaderBytes, more, std::byte{0x5A});
  const auto put_u32 = [&](std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) newer[at + i] = static_cast<std::byte>(value >> (8 * i));
  };
  put_at(newer, blob::kMinorAt, {blob::kMinor + 1U});
  put_u32(blob::kHeaderBytesAt, blob::kHeaderBytes + more);
  put_u32(blob::kFileBytesAt, newer.size());
  for (std::size_t s = 0; s < blob::kSectionCount; ++s) {
    const std::size_t at = blob::kSectionTableAt + s * blob::kSectionEntryBytes;
    put_u32(at, blob::load_u32(newer.data() + at) + more);
  }
  repair_checksum(newer);
  return newer;
}

TEST(BlobAppended, EncodesTheGoldenModelToTheGoldenBytes) {
  const auto bytes = model::encode_blob(golden_model_2_1());
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  if (std::getenv("RAVENCAL_WRITE_GOLDEN") != nullptr) {
    const std::filesystem::path folder(RAVENCAL_SOURCE_DIR "/tests/golden");
    ASSERT_TRUE(model::write_blob(golden_model_2_1(), folder / kGolden).ok());
  }
  const Bytes golden = golden_bytes(kGolden);
  ASSERT_EQ(bytes->size(), golden.size());
  // The self-test outputs may differ in their last bits between machines (exp), and with them the
  // checksum; everything else is the same to the byte.
  const blob::SectionEntry self_test = blob::section_entry(golden.data(), blob::kSelfTest);
  for (std::size_t at = 0; at < golden.size() - blob::kTrailerBytes; ++at) {
    if (at >= self_test.offset && at < self_test.offset + self_test.bytes) continue;
    ASSERT_EQ((*bytes)[at], golden[at])
        << "byte " << at << ": the format changed; raise its version, or undo";
  }
}

TEST(BlobAppended, GoldenBytesSayWhatTheirJsonTwinSays) {
  std::ifstream file(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tests" / "golden" /
                     "weights_v2_1.json");
  const auto twin = nlohmann::json::parse(file);
  const Bytes bytes = golden_bytes(kGolden);
  EXPECT_EQ(twin["bytes"], bytes.size());
  EXPECT_EQ(twin["minor"], blob::load_u16(bytes.data() + 14));
  EXPECT_EQ(twin["header_bytes"], blob::load_u32(bytes.data() + 16));
  EXPECT_EQ(twin["arm"], blob::load_u32(bytes.data() + 192));
  EXPECT_EQ(twin["coordinates"], blob::load_u32(bytes.data() + 196));
  EXPECT_EQ(twin["robot"], reinterpret_cast<const char*>(bytes.data() + 200));
  EXPECT_EQ(twin["controller"], reinterpret_cast<const char*>(bytes.data() + 232));
  EXPECT_EQ(twin["loop_flags"], blob::load_u32(bytes.data() + 264));
  EXPECT_EQ(twin["loop_rows"], blob::load_u32(bytes.data() + 268));
  EXPECT_EQ(twin["gain_margin"], blob::load_f32(bytes.data() + 272));
  EXPECT_EQ(twin["phase_margin_rad"], blob::load_f32(bytes.data() + 276));
  for (std::size_t group = 0; group < 3; ++group) {
    for (std::size_t j = 0; j < 2; ++j) {
      EXPECT_EQ(twin["loop_gains"][group][j],
                blob::load_f32(bytes.data() + 320 + 64 * group + 4 * j));
    }
  }
}

TEST(BlobAppended, ViewAndDecoderGiveBackOriginAndGains) {
  const Bytes bytes = golden_bytes(kGolden);
  BlobView view;
  ASSERT_TRUE(BlobView::open(bytes, view).ok());
  EXPECT_EQ(view.arm(), model::Arm::kGreen);
  EXPECT_EQ(view.coordinates(), model::Coordinates::kMotor);
  EXPECT_EQ(view.robot(), "RAVEN-II");
  EXPECT_EQ(view.controller(), "crtk");
  EXPECT_TRUE(view.loop().gains_known && view.loop().margins_known);
  EXPECT_EQ(view.loop().gain_margin, 4.0F);
  EXPECT_EQ(view.loop_gain(model::LoopGroup::kVelocity, 1), 1.0F);
  const auto decoded = model::decode_blob(bytes, "golden");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  const model::CalibrationModel expected = golden_model_2_1();
  EXPECT_EQ(decoded->origin, expected.origin);
  ASSERT_TRUE(decoded->loop_gains.has_value());
  EXPECT_EQ(decoded->loop_gains->by_group, expected.loop_gains->by_group);
  EXPECT_EQ(decoded->loop_gains->rows, expected.loop_gains->rows);
  EXPECT_EQ(decoded->loop_gains->margins->phase_rad, 1.5);
}

TEST(BlobAppended, VersionTwoZeroHasAnUnknownOriginAndUnknownGains) {
  const Bytes bytes = golden_bytes("weights_v2.blob");
  BlobView view;
  ASSERT_TRUE(BlobView::open(bytes, view).ok());
  EXPECT_EQ(view.arm(), model::Arm::kUnknown);
  EXPECT_EQ(view.coordinates(), model::Coordinates::kUnknown);
  EXPECT_TRUE(view.robot().empty() && view.controller().empty());
  EXPECT_FALSE(view.loop().gains_known || view.loop().margins_known);
  EXPECT_EQ(view.loop_gain(model::LoopGroup::kDesired, 1), 0.0F);
  const auto decoded = model::decode_blob(bytes, "golden");
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->origin, model::Origin{});
  EXPECT_FALSE(decoded->loop_gains.has_value());
}

TEST(BlobAppended, ReadsAHeaderThatALaterMinorVersionMadeLonger) {
  const Bytes newer = with_longer_header(64);
  BlobView view;
  const BlobCheck result = BlobView::open(newer, view);
  ASSERT_TRUE(result.ok()) << describe(result.status) << " at byte " << result.offset;
  EXPECT_EQ(view.feature(0).channel, "jpos.elbow");
  EXPECT_EQ(view.network().weight(view.network().layer(0), 1, 2), 6.0F);
  EXPECT_EQ(view.arm(), model::Arm::kGreen);
}

TEST(BlobAppended, RefusesEveryFlippedByteAndEveryTruncation) {
  const Bytes good = golden_bytes(kGolden);
  Bytes bad = good;
  BlobView view;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (unsigned flip = 1; flip < 256; ++flip) {
      bad[at] = good[at] ^ static_cast<std::byte>(flip);
      ASSERT_FALSE(BlobView::open(bad, view).ok()) << "byte " << at << " flipped by " << flip;
    }
    bad[at] = good[at];
    ASSERT_EQ(BlobView::open(std::span(good).first(at), view).status, BlobStatus::kTooShort);
  }
}

TEST(BlobAppended, NamesEveryRuleThatAWrongWriterBreaks) {
  const Bytes good = golden_bytes(kGolden);
  struct Case {
    const char* what;
    std::size_t at;
    std::initializer_list<unsigned> bytes;
    BlobStatus expected;
  };
  const auto nan32 = {0x00U, 0x00U, 0xC0U, 0x7FU};
  const Case cases[] = {
      {"minor version 0 with a long header", blob::kMinorAt, {0}, BlobStatus::kSize},
      {"arm", blob::kArmAt, {3}, BlobStatus::kOrigin},
      {"coordinates", blob::kCoordinatesAt, {0, 1}, BlobStatus::kOrigin},
      {"control character", blob::kRobotAt, {'\n'}, BlobStatus::kOrigin},
      {"text behind the end", blob::kRobotAt + 20, {'x'}, BlobStatus::kOrigin},
      {"endless name", blob::kControllerAt + 31, {'x'}, BlobStatus::kOrigin},
      {"unknown flag", blob::kLoopFlagsAt, {7}, BlobStatus::kLoopGain},
      {"margins without gains", blob::kLoopFlagsAt, {2}, BlobStatus::kLoopGain},
      {"gains without a flag", blob::kLoopFlagsAt, {0}, BlobStatus::kLoopGain},
      {"margins without a flag", blob::kLoopFlagsAt, {1}, BlobStatus::kReserved},
      {"gain margin", blob::kGainMarginAt, nan32, BlobStatus::kLoopGain},
      {"phase margin", blob::kPhaseMarginAt + 3, {0x41}, BlobStatus::kLoopGain},
      {"reserved", blob::kLoopTailAt, {1}, BlobStatus::kReserved},
      {"loop gain", blob::kLoopGainsAt, nan32, BlobStatus::kLoopGain},
      {"negative loop gain", blob::kLoopGainsAt + 3, {0xBF}, BlobStatus::kLoopGain},
      {"gain of no output", blob::kLoopGainsAt + 8, {1}, BlobStatus::kReserved},
  };
  for (const Case& test : cases) {
    Bytes bad = good;
    put_at(bad, test.at, test.bytes);
    repair_checksum(bad);
    BlobView view;
    const BlobCheck result = BlobView::open(bad, view);
    EXPECT_EQ(result.status, test.expected)
        << test.what << ": " << describe(result.status) << " at byte " << result.offset;
  }
}

TEST(BlobAppended, RefusesNamesThatItCannotHold) {
  model::CalibrationModel model = golden_model_2_1();
  model.origin.robot = std::string(32, 'r');
  auto result = model::encode_blob(model);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("robot"), std::string::npos) << result.error().message;
  model = golden_model_2_1();
  model.origin.controller = "tab\tin it";
  result = model::encode_blob(model);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("controller"), std::string::npos);
}

TEST(BlobAppended, InfinityReadsBackAsInfinity) {
  model::CalibrationModel model = golden_model_2_1();
  model.loop_gains->margins = {std::numeric_limits<double>::infinity(), 3.14159265358979};
  const auto bytes = model::encode_blob(model);
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  const auto decoded = model::decode_blob(*bytes, "endless");
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->loop_gains->margins->gain, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace ravencal::test
