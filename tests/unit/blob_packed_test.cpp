// SPDX-License-Identifier: Apache-2.0
//
// Blobs of every precision: that they read back, and that nothing damaged is accepted.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "model/single_precision.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

namespace blob = model::blob;
using model::BlobStatus;
using model::BlobView;
using model::packed::Precision;
using Bytes = std::vector<std::byte>;

/// Three inputs, 20 and 17 hidden units: panels, padding, and a last layer of rows.
model::CalibrationModel sample_model() {
  std::srand(3);  // Eigen's Random
  model::CalibrationModel model = golden_model();
  model.layers = {
      {Eigen::MatrixXf::Random(20, 3), Eigen::VectorXf::Random(20), model::Activation::kRelu},
      {Eigen::MatrixXf::Random(17, 20), Eigen::VectorXf::Random(17), model::Activation::kSigmoid},
      {Eigen::MatrixXf::Random(2, 17), Eigen::VectorXf::Random(2), model::Activation::kLinear}};
  return model;
}

model::FeatureMatrix sample_rows(const model::CalibrationModel& model) {
  const Eigen::MatrixXd along = (Eigen::MatrixXd::Random(100, 3).array() + 1.0) / 2.0;
  const Eigen::RowVectorXd width = (model.input_max - model.input_min).transpose();
  Eigen::MatrixXd rows = along.array().rowwise() * width.array();
  rows.rowwise() += model.input_min.transpose();
  return rows.cast<float>();
}

Bytes encode(Precision precision) {
  const model::CalibrationModel model = sample_model();
  model::Packing packing{precision, {}};
  packing.inputs = *model::measure_layer_inputs(model, sample_rows(model));
  const auto bytes = model::encode_blob(model, packing);
  EXPECT_TRUE(bytes.ok()) << (bytes.ok() ? "" : bytes.error().message);
  return *bytes;
}

class PackedBlob : public ::testing::TestWithParam<Precision> {};

INSTANTIATE_TEST_SUITE_P(EveryPrecision, PackedBlob,
                         ::testing::Values(Precision::kFloat32, Precision::kBfloat16,
                                           Precision::kInt8));

TEST_P(PackedBlob, ReadsBackAsRoundedAndNoFarther) {
  const model::CalibrationModel model = sample_model();
  const auto decoded = model::decode_blob(encode(GetParam()), "sample");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  const auto precision = static_cast<std::size_t>(GetParam());
  // Half a unit: of 8 bits of a number, or of 127 units of a row's largest weight (1 here).
  const float allowed[] = {0.0F, std::ldexp(1.0F, -9), 0.5F / 127.0F + 1e-6F};
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    const Eigen::MatrixXf difference = decoded->layers[l].weights - model.layers[l].weights;
    const bool is_last = l == 2;  // f32 in every precision
    EXPECT_LE(difference.cwiseAbs().maxCoeff(), is_last ? 0.0F : allowed[precision]);
    EXPECT_EQ(decoded->layers[l].activation, model.layers[l].activation);
    EXPECT_EQ(decoded->layers[l].input_step > 0.0F, !is_last && GetParam() == Precision::kInt8);
  }
}

TEST_P(PackedBlob, SelfTestToleranceFitsThePrecision) {
  const Bytes bytes = encode(GetParam());
  const auto decoded = model::decode_blob(bytes, "sample");
  ASSERT_TRUE(decoded.ok());
  BlobView view;
  ASSERT_TRUE(BlobView::open(bytes, view).ok());
  EXPECT_EQ(view.precision(), GetParam());
  for (std::size_t j = 0; j < 2; ++j) {
    // int8 rounds inputs to 2^-15 of a limit, some of which an error moves over a boundary; without
    // it only f32's own rounding is left.
    const double limit = GetParam() == Precision::kInt8 ? 1e-3 : 1e-4;
    EXPECT_LT(view.self_test_tolerance(j), limit * view.output_scale(j));
    Eigen::MatrixXf x(3, 1);
    for (int i = 0; i < 3; ++i) x(i, 0) = view.self_test_input(5, static_cast<std::size_t>(i));
    const Eigen::MatrixXf y = model::predict_single(*decoded, x);
    EXPECT_NEAR(static_cast<double>(y(static_cast<int>(j), 0)), view.self_test_output(5, j),
                view.self_test_tolerance(j));
  }
}

TEST_P(PackedBlob, RefusesEveryFlippedBitAndEveryTruncation) {
  const Bytes good = encode(GetParam());
  BlobView view;
  ASSERT_TRUE(BlobView::open(good, view).ok());
  Bytes bad = good;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      bad[at] = good[at] ^ static_cast<std::byte>(1U << bit);
      ASSERT_FALSE(BlobView::open(bad, view).ok()) << "byte " << at << " bit " << bit;
    }
    bad[at] = good[at];
    ASSERT_EQ(BlobView::open(std::span(good).first(at), view).status, BlobStatus::kTooShort);
  }
}

// Behind a right checksum: no single changed byte of the network may overflow a sum, read out of
// bounds or bring in a value that is not finite. What is accepted is another value of a weight.
TEST_P(PackedBlob, BehindTheChecksumOnlyOtherFiniteValuesAreAccepted) {
  const Bytes good = encode(GetParam());
  const blob::SectionEntry network = blob::section_entry(good.data(), blob::kNetwork);
  const std::size_t tables =
      sizeof(model::packed::PackedHeader) + 3 * sizeof(model::packed::PackedLayer);
  for (std::size_t at = network.offset; at < network.offset + network.bytes; ++at) {
    Bytes bad = good;
    bad[at] ^= std::byte{0x80};
    repair_checksum(bad);
    BlobView view;
    const bool accepted = BlobView::open(bad, view).ok();
    if (at - network.offset < tables && accepted) {
      // Only the value of an input step may be another one.
      const std::size_t in_layer = (at - network.offset) % sizeof(model::packed::PackedLayer);
      EXPECT_TRUE(in_layer >= 12 && in_layer < 16) << at - network.offset;
    }
    if (!accepted) continue;
    for (std::size_t l = 0; l < 3; ++l) {
      const model::packed::PackedLayer layer = view.network().layer(l);
      for (std::uint32_t o = 0; o < layer.outputs; ++o) {
        ASSERT_TRUE(std::isfinite(view.network().bias(layer, o)));
        for (std::uint32_t i = 0; i < layer.inputs; ++i) {
          ASSERT_TRUE(std::isfinite(view.network().weight(layer, o, i)));
        }
      }
    }
  }
}

TEST(PackedBlobs, Int8RefusesSumsThatDoNotBelongToTheWeights) {
  Bytes bad = encode(Precision::kInt8);
  BlobView view;
  ASSERT_TRUE(BlobView::open(bad, view).ok());
  const std::size_t network = blob::section_entry(bad.data(), blob::kNetwork).offset;
  const model::packed::PackedLayer layer = view.network().layer(1);
  const Bytes good = bad;
  bad[network + layer.weights_at] ^= std::byte{1};
  repair_checksum(bad);
  EXPECT_EQ(BlobView::open(bad, view).status, BlobStatus::kWeight);
  bad = good;
  bad[network + layer.row_sums_at] ^= std::byte{1};
  repair_checksum(bad);
  EXPECT_EQ(BlobView::open(bad, view).status, BlobStatus::kWeight);
  bad = good;  // a row whose largest weight would be infinite
  bad[network + layer.row_scales_at + 3] = std::byte{0x7F};
  bad[network + layer.row_scales_at + 2] = std::byte{0x00};
  repair_checksum(bad);
  EXPECT_EQ(BlobView::open(bad, view).status, BlobStatus::kWeight);
  bad = good;  // another precision in the header than in the layers
  bad[blob::kPrecisionAt] = std::byte{1};
  repair_checksum(bad);
  EXPECT_EQ(BlobView::open(bad, view).status, BlobStatus::kPrecision);
}

TEST(PackedBlobs, RefusesWhatAPrecisionCannotHold) {
  model::CalibrationModel model = sample_model();
  const auto uncalibrated = model::encode_blob(model, {Precision::kInt8, {}});
  ASSERT_FALSE(uncalibrated.ok());
  EXPECT_NE(uncalibrated.error().message.find("every layer's inputs"), std::string::npos);
  model.layers[0].weights(0, 0) = 3.4e38F;
  const auto too_large = model::encode_blob(model, {Precision::kBfloat16, {}});
  ASSERT_FALSE(too_large.ok());
  EXPECT_NE(too_large.error().message.find("bf16"), std::string::npos);
}

TEST(LayerInputs, AreTheMeansAndLimitsThatTheLayersSee) {
  const model::CalibrationModel model = sample_model();
  model::FeatureMatrix rows = sample_rows(model);
  rows(7, 1) = std::numeric_limits<float>::quiet_NaN();  // a lost value: its row is left out
  const auto inputs = model::measure_layer_inputs(model, rows);
  ASSERT_TRUE(inputs.ok());
  for (Eigen::Index i = 0; i < 3; ++i) {
    double sum = 0.0;
    for (Eigen::Index row = 0; row < 100; ++row) {
      if (row != 7) sum += static_cast<double>(rows(row, i));
    }
    const double mean = (sum / 99.0 - model.input.mean[i]) / model.input.scale[i];
    EXPECT_NEAR(static_cast<double>((*inputs)[0].mean[i]), mean, 1e-5);
  }
  // Half a width beyond -8..4 is -14..10; scaled by mean -2 and scale 4 that is -3..3.
  EXPECT_FLOAT_EQ((*inputs)[0].limit, 3.0F);
  EXPECT_GT((*inputs)[1].limit, 1.0F) << "behind relu: twice what was seen";
  EXPECT_EQ((*inputs)[2].limit, 1.0F) << "behind sigmoid";
  rows.setConstant(std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(model::measure_layer_inputs(model, rows).ok());
}

// Golden files of the other precisions.
class GoldenPrecision : public ::testing::TestWithParam<Precision> {
 protected:
  [[nodiscard]] static std::string stem() {
    return "weights_v2_" + std::string(model::name_of(GetParam()));
  }
};

INSTANTIATE_TEST_SUITE_P(Rounded, GoldenPrecision,
                         ::testing::Values(Precision::kBfloat16, Precision::kInt8));

TEST_P(GoldenPrecision, EncodesToTheGoldenBytes) {
  const auto bytes = model::encode_blob(golden_wide_model(), golden_packing(GetParam()));
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  const Bytes golden = golden_bytes(stem() + ".blob");
  // The files are of version 2.0: the sections begin earlier, by what 2.1 appended to the header.
  constexpr std::size_t kAppended = blob::kHeaderBytes - blob::kFirstHeaderBytes;
  ASSERT_EQ(bytes->size(), golden.size() + kAppended);
  // Outputs and tolerances of the self-test may differ in their last bits between machines (exp).
  const blob::SectionEntry self_test = blob::section_entry(golden.data(), blob::kSelfTest);
  for (std::size_t at = blob::kFirstHeaderBytes; at < golden.size() - blob::kTrailerBytes; ++at) {
    if (at >= self_test.offset && at < self_test.offset + self_test.bytes) continue;
    ASSERT_EQ((*bytes)[at + kAppended], golden[at]) << "byte " << at << ": the format changed";
  }
}

// The twin was written by hand from FORMATS.md: units and row scales of int8, upper halves of bf16.
TEST_P(GoldenPrecision, GoldenBytesSayWhatTheirJsonTwinSays) {
  std::ifstream file(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tests" / "golden" /
                     (stem() + ".json"));
  const auto twin = nlohmann::json::parse(file);
  const Bytes bytes = golden_bytes(stem() + ".blob");
  BlobView view;
  ASSERT_TRUE(BlobView::open(bytes, view).ok());
  EXPECT_EQ(twin["bytes"], bytes.size());
  EXPECT_EQ(twin["precision"], model::name_of(view.precision()));
  const std::byte* const network =
      bytes.data() + blob::section_entry(bytes.data(), blob::kNetwork).offset;
  const model::packed::PackedLayer layer = view.network().layer(0);
  ASSERT_EQ(twin["stored"].size(), layer.outputs);
  for (std::uint32_t o = 0; o < layer.outputs; ++o) {
    EXPECT_NEAR(twin["biases"][o].get<double>(), static_cast<double>(view.network().bias(layer, o)),
                1e-6);
    for (std::uint32_t i = 0; i < layer.inputs; ++i) {
      const std::size_t at = element_index(layer, o, i);
      const std::byte* const stored = network + layer.weights_at;
      const int value = GetParam() == Precision::kInt8
                            ? static_cast<int>(static_cast<std::int8_t>(stored[at]))
                            : static_cast<int>(blob::load_u16(stored + 2 * at));
      EXPECT_EQ(twin["stored"][o][i], value) << "unit " << o << " input " << i;
    }
    if (GetParam() != Precision::kInt8) continue;
    EXPECT_NEAR(twin["row_scales"][o].get<double>(),
                static_cast<double>(blob::load_f32(network + layer.row_scales_at + 4 * o)), 1e-10);
    EXPECT_EQ(twin["row_sums"][o],
              static_cast<std::int32_t>(blob::load_u32(network + layer.row_sums_at + 4 * o)));
  }
}

TEST_P(GoldenPrecision, RefusesEveryFlippedByteAndEveryTruncationWithAName) {
  const Bytes good = golden_bytes(stem() + ".blob");
  BlobView view;
  ASSERT_TRUE(BlobView::open(good, view).ok());
  Bytes bad = good;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (unsigned flip = 1; flip < 256; ++flip) {
      bad[at] = good[at] ^ static_cast<std::byte>(flip);
      const model::BlobCheck check = BlobView::open(bad, view);
      ASSERT_FALSE(check.ok()) << "byte " << at << " flipped by " << flip;
      ASSERT_STRNE(describe(check.status), "unknown reason");
    }
    bad[at] = good[at];
    ASSERT_EQ(BlobView::open(std::span(good).first(at), view).status, BlobStatus::kTooShort);
  }
}

}  // namespace
}  // namespace ravencal::test
