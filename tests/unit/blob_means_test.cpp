// SPDX-License-Identifier: Apache-2.0
//
// Version 2.2 of a blob: exponential means.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "unit/blob_bytes.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

namespace blob = model::blob;
namespace fs = std::filesystem;
using model::BlobCheck;
using model::BlobStatus;
using model::BlobView;
using model::Transform;
using Bytes = std::vector<std::byte>;

constexpr const char* kGoldenOfMeans = "weights_v2_2.blob";

fs::path golden_folder() { return fs::path(RAVENCAL_SOURCE_DIR) / "tests" / "golden"; }

void put_f32(Bytes& bytes, std::size_t at, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(bits >> (8 * i));
}

TEST(BlobMeans, EncodesTheGoldenModelToTheGoldenBytes) {
  const Bytes bytes = encoded(golden_model_2_2());
  if (std::getenv("RAVENCAL_WRITE_GOLDEN") != nullptr) {
    ASSERT_TRUE(model::write_blob(golden_model_2_2(), golden_folder() / kGoldenOfMeans).ok());
  }
  const Bytes golden = golden_bytes(kGoldenOfMeans);
  ASSERT_EQ(bytes.size(), golden.size());
  // The last bits of the self-test's outputs, and with them the checksum, are the machine's.
  const blob::SectionEntry self_test = blob::section_entry(golden.data(), blob::kSelfTest);
  for (std::size_t at = 0; at < golden.size() - blob::kTrailerBytes; ++at) {
    if (at >= self_test.offset && at < self_test.offset + self_test.bytes) continue;
    ASSERT_EQ(bytes[at], golden[at]) << "byte " << at << ": the format changed";
  }
}

TEST(BlobMeans, GoldenBytesSayWhatTheirJsonTwinSays) {
  std::ifstream file(golden_folder() / "weights_v2_2.json");
  const auto twin = nlohmann::json::parse(file);
  const Bytes bytes = golden_bytes(kGoldenOfMeans);
  EXPECT_EQ(twin["bytes"], bytes.size());
  EXPECT_EQ(twin["minor"], blob::load_u16(bytes.data() + 14));
  EXPECT_EQ(twin["header_bytes"], blob::load_u32(bytes.data() + 16));
  for (std::size_t i = 0; i < 3; ++i) {
    const std::byte* const record = bytes.data() + feature_at(bytes, i);
    EXPECT_EQ(twin["features"][i]["channel"], reinterpret_cast<const char*>(record + 16));
    EXPECT_EQ(twin["features"][i]["transform"], static_cast<int>(record[2]));
    EXPECT_EQ(twin["features"][i]["parameter"], blob::load_f32(record + 8));
  }
}

TEST(BlobMeans, ComeBackAsTheyWere) {
  const Bytes bytes = golden_bytes(kGoldenOfMeans);
  BlobView view;
  const BlobCheck check = BlobView::open(bytes, view);
  ASSERT_TRUE(check.ok()) << describe(check.status) << " at byte " << check.offset;
  EXPECT_EQ(view.feature(1).transform, Transform::kMean);
  EXPECT_EQ(view.feature(1).time_constant_s, 0.5F);
  EXPECT_EQ(view.feature(1).play_half_width, 0.0F);
  EXPECT_EQ(view.feature(2).transform, Transform::kMeanOfAbs);
  EXPECT_EQ(view.feature(2).time_constant_s, 128.0F);
  const auto decoded = model::decode_blob(bytes, "golden");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->features, golden_model_2_2().features);
  const auto text = model::describe_blob(golden_folder() / kGoldenOfMeans);
  ASSERT_TRUE(text.ok()) << text.error().message;
  for (const char* input : {"jpos.elbow%0.5 ", "mpos.shoulder%abs128 "}) {
    EXPECT_NE(text->find(input), std::string::npos) << *text;
  }
}

TEST(BlobMeans, AloneRaiseTheMinorVersion) {
  EXPECT_EQ(blob::load_u16(encoded(golden_model()).data() + blob::kMinorAt), 1);
  EXPECT_EQ(blob::load_u16(encoded(golden_model_2_1()).data() + blob::kMinorAt), 1);
  EXPECT_EQ(blob::load_u16(encoded(golden_model_2_2()).data() + blob::kMinorAt), 2);
}

TEST(BlobMeans, AreRefusedInAnEarlierVersionAndUnknownTransformsInEvery) {
  Bytes bytes = golden_bytes(kGoldenOfMeans);
  bytes[blob::kMinorAt] = std::byte{1};
  const BlobCheck earlier = check_repaired(bytes);
  EXPECT_EQ(earlier.status, BlobStatus::kFeature);
  EXPECT_EQ(earlier.offset, feature_at(bytes, 1) + 2);
  for (const unsigned minor : {2U, 3U, 9U}) {
    bytes = golden_bytes(kGoldenOfMeans);
    bytes[blob::kMinorAt] = static_cast<std::byte>(minor);
    EXPECT_TRUE(check_repaired(bytes).ok()) << "2." << minor;
    bytes[feature_at(bytes, 1) + 2] = std::byte{7};
    EXPECT_EQ(check_repaired(bytes).status, BlobStatus::kFeature) << "2." << minor;
  }
}

TEST(BlobMeans, HaveATimeConstantWithinItsRange) {
  const Bytes golden = golden_bytes(kGoldenOfMeans);
  const std::size_t parameter = feature_at(golden, 2) + blob::kFeatureParameterAt;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float bad : {0.0F, -0.0F, -1.0F, 0.0009F, 1000.1F, kNan, kInfinity, -kInfinity}) {
    Bytes bytes = golden;
    put_f32(bytes, parameter, bad);
    const BlobCheck check = check_repaired(bytes);
    EXPECT_EQ(check.status, BlobStatus::kFeature) << bad;
    EXPECT_EQ(check.offset, parameter) << bad;
    model::CalibrationModel model = golden_model_2_2();
    model.features[1].time_constant_s = bad;
    EXPECT_FALSE(model::encode_blob(model).ok()) << bad;
  }
  for (const float good : {model::kMinTimeConstantS, model::kMaxTimeConstantS}) {
    Bytes bytes = golden;
    put_f32(bytes, parameter, good);
    EXPECT_TRUE(check_repaired(bytes).ok()) << good;
  }
  Bytes lagged = golden;
  lagged[feature_at(golden, 1) + blob::kFeatureLagAt] = std::byte{1};
  EXPECT_EQ(check_repaired(lagged).status, BlobStatus::kFeature) << "a mean has no lag";
  Bytes plain = golden;
  put_f32(plain, feature_at(golden, 0) + blob::kFeatureParameterAt, 0.5F);
  EXPECT_EQ(check_repaired(plain).status, BlobStatus::kFeature) << "a value has no time constant";
  Bytes reserved = golden;
  reserved[feature_at(golden, 1) + blob::kFeatureAlongAt] = std::byte{1};
  EXPECT_EQ(check_repaired(reserved).status, BlobStatus::kReserved);
}

}  // namespace
}  // namespace ravencal::test
