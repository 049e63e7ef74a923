// SPDX-License-Identifier: Apache-2.0
//
// Means over travel in a blob: their length, and the input that is their position.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "unit/blob_bytes.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

namespace blob = model::blob;
using model::BlobCheck;
using model::BlobStatus;
using model::BlobView;
using model::Transform;
using Bytes = std::vector<std::byte>;

/// The golden model with two means over the travel of its last input.
model::CalibrationModel travel_model() {
  model::CalibrationModel model = golden_model_2_1();
  model.features = {
      {"tau.elbow", Transform::kTravelMean, 0, 0.0F, 0.0F, 0.25F, "jpos.elbow"},
      {"mpos.shoulder", Transform::kTravelMeanOfAbs, 0, 0.0F, 0.0F, 128.0F, "jpos.elbow"},
      {"jpos.elbow"}};
  return model;
}

void put_u32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(value >> (8 * i));
}

void expect_refused(const Bytes& bytes, BlobStatus status, std::size_t at,
                    const std::string& what) {
  const BlobCheck check = check_repaired(bytes);
  EXPECT_EQ(check.status, status) << what;
  EXPECT_EQ(check.offset, at) << what;
}

TEST(BlobTravel, ComesBackAsItWas) {
  const model::CalibrationModel model = travel_model();
  const Bytes bytes = encoded(model);
  EXPECT_EQ(blob::load_u16(bytes.data() + blob::kMinorAt), 2);
  BlobView view;
  const BlobCheck check = BlobView::open(bytes, view);
  ASSERT_TRUE(check.ok()) << describe(check.status) << " at byte " << check.offset;
  EXPECT_EQ(view.feature(0).transform, Transform::kTravelMean);
  EXPECT_EQ(view.feature(0).travel_si, 0.25F);
  EXPECT_EQ(view.feature(0).along, 2U);
  EXPECT_EQ(view.feature(0).time_constant_s, 0.0F);
  EXPECT_EQ(view.feature(0).play_half_width, 0.0F);
  EXPECT_EQ(view.feature(1).transform, Transform::kTravelMeanOfAbs);
  EXPECT_EQ(view.feature(1).travel_si, 128.0F);
  EXPECT_EQ(view.feature(1).along, 2U);
  const auto decoded = model::decode_blob(bytes, "travel");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->features, model.features);
  EXPECT_EQ(encoded(*decoded), bytes);
}

TEST(BlobTravel, HasTheBytesOfTheFormat) {
  const Bytes bytes = encoded(travel_model());
  for (const auto& [i, transform, length] : {std::tuple{0U, 5, 0.25F}, std::tuple{1U, 6, 128.0F}}) {
    const std::byte* const record = bytes.data() + feature_at(bytes, i);
    EXPECT_EQ(static_cast<int>(record[2]), transform);
    EXPECT_EQ(blob::load_u32(record + 4), 0U);
    EXPECT_EQ(blob::load_f32(record + 8), length);
    EXPECT_EQ(blob::load_u32(record + 12), 3U) << "1 + the input that is the position";
  }
  EXPECT_EQ(blob::load_u32(bytes.data() + feature_at(bytes, 2) + 12), 0U);
}

TEST(BlobTravel, IsDescribedWithItsPosition) {
  const auto path = std::filesystem::temp_directory_path() / "ravencal_blob_travel_test.blob";
  ASSERT_TRUE(model::write_blob(travel_model(), path).ok());
  const auto text = model::describe_blob(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(text.ok()) << text.error().message;
  for (const char* input : {"tau.elbow%0.25:jpos.elbow ", "mpos.shoulder%abs128:jpos.elbow "}) {
    EXPECT_NE(text->find(input), std::string::npos) << *text;
  }
}

TEST(BlobTravel, IsRefusedInAnEarlierVersion) {
  Bytes bytes = encoded(travel_model());
  bytes[blob::kMinorAt] = std::byte{1};
  expect_refused(bytes, BlobStatus::kFeature, feature_at(bytes, 0) + blob::kFeatureTransformAt,
                 "2.1");
}

TEST(BlobTravel, HasALengthWithinItsRange) {
  const Bytes good = encoded(travel_model());
  const std::size_t parameter = feature_at(good, 1) + blob::kFeatureParameterAt;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float bad : {0.0F, -0.0F, -1.0F, 0.9e-6F, 1000.1F, kNan, kInfinity, -kInfinity}) {
    Bytes bytes = good;
    put_u32(bytes, parameter, std::bit_cast<std::uint32_t>(bad));
    expect_refused(bytes, BlobStatus::kFeature, parameter, std::to_string(bad));
    model::CalibrationModel model = travel_model();
    model.features[0].travel_si = bad;
    EXPECT_FALSE(model::encode_blob(model).ok()) << bad;
  }
  for (const float length : {model::kMinTravelSi, model::kMaxTravelSi}) {
    Bytes bytes = good;
    put_u32(bytes, parameter, std::bit_cast<std::uint32_t>(length));
    EXPECT_TRUE(check_repaired(bytes).ok()) << length;
  }
  Bytes lagged = good;
  lagged[feature_at(good, 1) + blob::kFeatureLagAt] = std::byte{1};
  expect_refused(lagged, BlobStatus::kFeature, feature_at(good, 1) + blob::kFeatureLagAt, "a lag");
}

TEST(BlobTravel, GoesByAnInputThatIsAPlainValue) {
  const Bytes good = encoded(travel_model());
  const std::size_t along = feature_at(good, 0) + blob::kFeatureAlongAt;
  // None, itself, another mean, beyond the inputs, and where adding or multiplying would overflow.
  for (const std::uint32_t bad : {0U, 1U, 2U, 4U, 0x04000003U, 0x80000000U, 0xFFFFFFFFU}) {
    Bytes bytes = good;
    put_u32(bytes, along, bad);
    expect_refused(bytes, BlobStatus::kFeature, along, std::to_string(bad));
  }
  for (const Transform other : {Transform::kLag, Transform::kPlay, Transform::kMean}) {
    Bytes bytes = good;
    const std::size_t position = feature_at(good, 2);
    bytes[position + blob::kFeatureTransformAt] = static_cast<std::byte>(other);
    put_u32(bytes, position + blob::kFeatureLagAt, other == Transform::kLag ? 1 : 0);
    put_u32(bytes, position + blob::kFeatureParameterAt,
            other == Transform::kLag ? 0 : std::bit_cast<std::uint32_t>(0.5F));
    expect_refused(bytes, BlobStatus::kFeature, along, std::to_string(static_cast<int>(other)));
  }
}

TEST(BlobTravel, AloneHasAPosition) {
  Bytes bytes = encoded(travel_model());
  const std::size_t along = feature_at(bytes, 2) + blob::kFeatureAlongAt;
  put_u32(bytes, along, 3);
  expect_refused(bytes, BlobStatus::kReserved, along, "a plain value");
}

TEST(BlobTravel, IsNotWrittenWithoutItsPosition) {
  model::CalibrationModel model = travel_model();
  model.features[2] = {"jpos.elbow", Transform::kLag, 3};
  const auto bytes = model::encode_blob(model);
  ASSERT_FALSE(bytes.ok());
  for (const char* part : {"'tau.elbow%0.25:jpos.elbow'", "travel of 'jpos.elbow'",
                           "no input of the model", "add jpos.elbow to the features"}) {
    EXPECT_NE(bytes.error().message.find(part), std::string::npos) << bytes.error().message;
  }
}

}  // namespace
}  // namespace ravencal::test
