// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "model/single_precision.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

namespace blob = model::blob;
using model::BlobCheck;
using model::BlobStatus;
using model::BlobView;
using Bytes = std::vector<std::byte>;

BlobCheck check(const Bytes& bytes) {
  BlobView view;
  return BlobView::open(bytes, view);
}

void put(Bytes& bytes, std::size_t at, std::initializer_list<unsigned> values) {
  for (const unsigned value : values) bytes[at++] = static_cast<std::byte>(value);
}

std::size_t section(const Bytes& bytes, blob::Section which) {
  return blob::section_entry(bytes.data(), which).offset;
}

std::size_t section_bytes(const Bytes& bytes) {
  return blob::section_entry(bytes.data(), blob::kNetwork).bytes;
}

TEST(Blob, GoldenBytesSayWhatTheirJsonTwinSays) {
  std::ifstream file(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tests" / "golden" /
                     "weights_v2.json");
  const auto twin = nlohmann::json::parse(file);
  const Bytes bytes = golden_bytes();
  BlobView view;
  ASSERT_TRUE(BlobView::open(bytes, view).ok());
  EXPECT_EQ(twin["bytes"], bytes.size());
  EXPECT_EQ(twin["precision"], model::name_of(view.precision()));
  EXPECT_EQ(twin["row_period_s"], view.row_period_s());
  ASSERT_EQ(twin["features"].size(), view.feature_count());
  for (std::size_t i = 0; i < view.feature_count(); ++i) {
    const auto& expected = twin["features"][i];
    const model::BlobFeature feature = view.feature(i);
    EXPECT_EQ(expected["channel"], feature.channel);
    EXPECT_EQ(expected["catalogue_index"], feature.catalogue_index);
    EXPECT_EQ(expected["transform"], static_cast<int>(feature.transform));
    EXPECT_EQ(expected["lag_rows"], feature.lag_rows);
    EXPECT_EQ(expected["half_width"], feature.play_half_width);
    EXPECT_EQ(expected["mean"], view.input_mean(i));
    EXPECT_EQ(expected["scale"], view.input_scale(i));
    EXPECT_EQ(expected["min"], view.input_min(i));
    EXPECT_EQ(expected["max"], view.input_max(i));
  }
  ASSERT_EQ(twin["layers"].size(), view.layer_count());
  for (std::size_t l = 0; l < view.layer_count(); ++l) {
    const auto& expected = twin["layers"][l];
    const model::packed::PackedLayer layer = view.network().layer(l);
    EXPECT_EQ(expected["activation"], static_cast<int>(layer.activation));
    ASSERT_EQ(expected["weights"].size(), layer.outputs);
    for (std::size_t row = 0; row < layer.outputs; ++row) {
      EXPECT_EQ(expected["biases"][row], view.network().bias(layer, row));
      ASSERT_EQ(expected["weights"][row].size(), layer.inputs);
      for (std::size_t column = 0; column < layer.inputs; ++column) {
        EXPECT_EQ(expected["weights"][row][column], view.network().weight(layer, row, column));
      }
    }
  }
  const auto& trust = twin["trust"];
  ASSERT_EQ(trust["directions"].size(), view.trust_rank());
  for (std::size_t k = 0; k < view.trust_rank(); ++k) {
    EXPECT_EQ(trust["inverse_variance"][k], view.trust_inverse_variance(k));
    for (std::size_t i = 0; i < view.feature_count(); ++i) {
      EXPECT_EQ(trust["directions"][k][i].get<float>(), view.trust_direction(k, i));
      EXPECT_EQ(view.trust_directions() + 16 * k + i,
                static_cast<const void*>(bytes.data() + section(bytes, blob::kTrust) +
                                         blob::kTrustDirectionsAt + 64 * k + 4 * i));
    }
  }
  EXPECT_EQ(trust["inverse_residual_variance"], view.trust_inverse_residual_variance());
  EXPECT_EQ(trust["full_distance"], view.trust_full_distance());
  EXPECT_EQ(trust["none_distance"], view.trust_none_distance());
  for (std::size_t j = 0; j < view.output_count(); ++j) {
    const auto& expected = twin["outputs"][j];
    EXPECT_EQ(expected["slot"], view.output(j).slot);
    EXPECT_EQ(expected["joint"], view.output(j).joint);
    EXPECT_EQ(expected["channel"], view.output(j).estimate_channel);
    EXPECT_EQ(expected["unit"], view.output(j).unit);
    EXPECT_EQ(expected["mean"], view.output_mean(j));
    EXPECT_EQ(expected["scale"], view.output_scale(j));
  }
  EXPECT_EQ(twin["provenance"], nlohmann::json::parse(view.provenance()));
}

TEST(Blob, DecodesToTheModelItWasMadeFrom) {
  const model::CalibrationModel expected = golden_model();
  const auto decoded = model::decode_blob(golden_bytes(), "golden");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->features, expected.features);
  EXPECT_EQ(decoded->input.mean, expected.input.mean);
  EXPECT_EQ(decoded->input.scale, expected.input.scale);
  EXPECT_EQ(decoded->input_min, expected.input_min);
  EXPECT_EQ(decoded->input_max, expected.input_max);
  ASSERT_EQ(decoded->layers.size(), expected.layers.size());
  for (std::size_t l = 0; l < expected.layers.size(); ++l) {
    EXPECT_EQ(decoded->layers[l].weights, expected.layers[l].weights);
    EXPECT_EQ(decoded->layers[l].biases, expected.layers[l].biases);
    EXPECT_EQ(decoded->layers[l].activation, expected.layers[l].activation);
  }
  ASSERT_TRUE(decoded->trust.has_value());
  EXPECT_EQ(decoded->trust->directions, expected.trust->directions);
  EXPECT_EQ(decoded->trust->inverse_variance, expected.trust->inverse_variance);
  EXPECT_EQ(decoded->trust->inverse_residual_variance, expected.trust->inverse_residual_variance);
  EXPECT_EQ(decoded->trust->full_distance, expected.trust->full_distance);
  EXPECT_EQ(decoded->trust->none_distance, expected.trust->none_distance);
  EXPECT_EQ(decoded->output.mean, expected.output.mean);
  EXPECT_EQ(decoded->output.scale, expected.output.scale);
  EXPECT_EQ(decoded->provenance, expected.provenance);
  EXPECT_EQ(decoded->row_period_s, expected.row_period_s);
}

TEST(Blob, RefusesEveryFlippedByteWithAName) {
  const Bytes good = golden_bytes();
  ASSERT_TRUE(check(good).ok());
  for (std::size_t at = 0; at < good.size(); ++at) {
    Bytes bad = good;
    for (unsigned flip = 1; flip < 256; ++flip) {
      bad[at] = good[at] ^ static_cast<std::byte>(flip);
      const BlobCheck result = check(bad);
      ASSERT_FALSE(result.ok()) << "byte " << at << " flipped by " << flip;
      ASSERT_STRNE(describe(result.status), "unknown reason");
      ASSERT_LE(result.offset, bad.size());
    }
  }
}

TEST(Blob, RefusesEveryTruncationAndExtension) {
  const Bytes good = golden_bytes();
  for (std::size_t size = 0; size < good.size(); ++size) {
    const BlobCheck result = check(Bytes(good.begin(), good.begin() + static_cast<long>(size)));
    ASSERT_EQ(result.status, BlobStatus::kTooShort) << size << " bytes";
  }
  for (const std::size_t more : {1U, 64U, 4096U}) {
    Bytes longer = good;
    longer.resize(good.size() + more);
    EXPECT_EQ(check(longer).status, BlobStatus::kSize);
  }
}

// Behind the checksum: whatever a wrong writer may produce is refused by the check it breaks.
TEST(Blob, NamesEveryRuleThatAWrongWriterBreaks) {
  const Bytes good = golden_bytes();
  const std::size_t trailer = good.size() - blob::kTrailerBytes;
  const auto nan = {0x00U, 0x00U, 0x00U, 0x00U, 0x00U, 0x00U, 0xF8U, 0x7FU};
  const auto nan32 = {0x00U, 0x00U, 0xC0U, 0x7FU};
  const auto zero64 = {0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U};
  struct Case {
    const char* what;
    std::size_t at;
    std::initializer_list<unsigned> bytes;
    BlobStatus expected;
  };
  const std::size_t features = section(good, blob::kFeatures);
  const std::size_t scaling = section(good, blob::kInputScaling);
  const std::size_t range = section(good, blob::kInputRange);
  const std::size_t network = section(good, blob::kNetwork);
  const std::size_t layers = network + sizeof(model::packed::PackedHeader);
  const std::size_t second = layers + sizeof(model::packed::PackedLayer);
  model::packed::PackedView packed;
  ASSERT_TRUE(model::packed::open_anywhere(good.data() + network, section_bytes(good), packed));
  const std::size_t weights = network + packed.layer(0).weights_at;
  const std::size_t biases = network + packed.layer(0).biases_at;
  const std::size_t trust = section(good, blob::kTrust);
  const std::size_t directions = trust + blob::kTrustDirectionsAt;
  const std::size_t outputs = section(good, blob::kOutputs);
  const std::size_t self_test = section(good, blob::kSelfTest);
  const std::size_t provenance = section(good, blob::kProvenance);
  const Case cases[] = {
      {"magic", 0, {0}, BlobStatus::kBadMagic},
      {"major version", blob::kMajorAt, {1}, BlobStatus::kVersion},
      {"header size", blob::kHeaderBytesAt, {0}, BlobStatus::kSize},
      {"precision", blob::kPrecisionAt, {3}, BlobStatus::kPrecision},
      {"no features", blob::kFeatureCountAt, {0}, BlobStatus::kCount},
      {"many features", blob::kFeatureCountAt, {0xFF, 0xFF}, BlobStatus::kCount},
      {"one feature more", blob::kFeatureCountAt, {4}, BlobStatus::kLayer},
      {"layers", blob::kLayerCountAt, {0xFF}, BlobStatus::kCount},
      {"outputs", blob::kOutputCountAt, {3}, BlobStatus::kLayer},
      {"self-tests", blob::kSelfTestCountAt, {9}, BlobStatus::kSection},
      {"many directions", blob::kTrustRankAt, {17}, BlobStatus::kCount},
      {"more directions than inputs", blob::kTrustRankAt, {4}, BlobStatus::kCount},
      {"one direction less", blob::kTrustRankAt, {1}, BlobStatus::kSection},
      {"row period", blob::kRowPeriodAt, nan, BlobStatus::kPeriod},
      {"header tail", 150, {1}, BlobStatus::kReserved},
      {"section offset", blob::kSectionTableAt, {1}, BlobStatus::kSection},
      {"section size", blob::kSectionTableAt + 4, {1}, BlobStatus::kSection},
      {"huge provenance",
       blob::kSectionTableAt + 8 * blob::kProvenance + 4,
       {0xFF, 0xFF, 0xFF, 0xFF},
       BlobStatus::kSection},
      {"transform", features + 2, {3}, BlobStatus::kFeature},
      {"lag of a plain value", features + 4, {1}, BlobStatus::kFeature},
      {"lag of zero rows", features + 64 + 4, {0}, BlobStatus::kFeature},
      {"half-width", features + 128 + 8, nan32, BlobStatus::kFeature},
      {"channel name", features + 16, {0}, BlobStatus::kFeature},
      {"blank in a name", features + 17, {' '}, BlobStatus::kFeature},
      {"mean", scaling, nan, BlobStatus::kScaling},
      {"scale of zero", scaling + 3 * 8, zero64, BlobStatus::kScaling},
      {"range", range, nan, BlobStatus::kRange},
      {"empty range", range + 7, {0x7F}, BlobStatus::kRange},
      {"activation", layers + 8, {4}, BlobStatus::kLayer},
      {"layer size", layers + 4, {3}, BlobStatus::kLayer},
      {"precision of a layer", layers + 9, {3}, BlobStatus::kLayer},
      {"reserved in a layer", layers + 10, {1}, BlobStatus::kLayer},
      {"input step of f32", layers + 15, {1}, BlobStatus::kLayer},
      {"bias offset", second + 16, {1}, BlobStatus::kLayer},
      {"weight offset", second + 40, {1}, BlobStatus::kLayer},
      {"layer count of the network", network, {1}, BlobStatus::kLayer},
      {"width of the network", network + 4, {1}, BlobStatus::kLayer},
      {"reserved in the network", network + 63, {1}, BlobStatus::kLayer},
      {"bias", biases, nan32, BlobStatus::kWeight},
      {"padding of biases", biases + 2 * 4, {1}, BlobStatus::kReserved},
      {"weight", weights, nan32, BlobStatus::kWeight},
      {"padding of weights", weights + 3 * 4, {1}, BlobStatus::kReserved},
      {"residual variance", trust, nan32, BlobStatus::kTrust},
      {"residual variance above a direction's", trust, {0, 0, 0, 0x3F}, BlobStatus::kTrust},
      {"full distance", trust + 4, {0, 0, 0, 0}, BlobStatus::kTrust},
      {"full distance of infinity", trust + 4, {0, 0, 0x80, 0x7F}, BlobStatus::kTrust},
      {"none distance", trust + 8, nan32, BlobStatus::kTrust},
      {"none at full distance", trust + 8, {0, 0, 0x80, 0x40}, BlobStatus::kTrust},
      {"reserved in trust", trust + 12, {1}, BlobStatus::kReserved},
      {"variance", trust + 64, nan32, BlobStatus::kTrust},
      {"negative variance", trust + 67, {0xBF}, BlobStatus::kTrust},
      {"variances that rise", trust + 68, {0, 0, 0, 0}, BlobStatus::kTrust},
      {"tiny residual variance", trust + 3, {0x7F}, BlobStatus::kTrust},
      {"padding of variances", trust + 72, {1}, BlobStatus::kReserved},
      {"direction", directions, nan32, BlobStatus::kTrust},
      {"direction of another length", directions + 2, {0x1C}, BlobStatus::kTrust},
      {"skew directions", directions + 64, {0, 0, 0x80, 0x3F}, BlobStatus::kTrust},
      {"padding of a direction", directions + 12, {1}, BlobStatus::kReserved},
      {"slot", outputs, {8}, BlobStatus::kOutput},
      {"slot twice", outputs + 128, {1}, BlobStatus::kOutput},
      {"unit", outputs + 104, {0}, BlobStatus::kOutput},
      {"tolerance", self_test, zero64, BlobStatus::kSelfTest},
      {"test output", self_test + 16, nan, BlobStatus::kSelfTest},
      {"provenance", provenance, {'['}, BlobStatus::kProvenance},
      {"control character", provenance + 3, {'\n'}, BlobStatus::kProvenance},
      {"kind of signature", trailer + 4, {2}, BlobStatus::kSignature},
      {"signed with nothing", trailer + 4, {1}, BlobStatus::kChecksum},
      {"signature of an unsigned blob", trailer + 70, {1}, BlobStatus::kReserved},
  };
  std::set<BlobStatus> seen;
  for (const Case& test : cases) {
    Bytes bad = good;
    put(bad, test.at, test.bytes);
    repair_checksum(bad);
    const BlobCheck result = check(bad);
    EXPECT_EQ(result.status, test.expected)
        << test.what << ": " << describe(result.status) << " at byte " << result.offset;
    seen.insert(result.status);
  }
  for (int status = 1; status <= static_cast<int>(BlobStatus::kProvenance); ++status) {
    const auto named = static_cast<BlobStatus>(status);
    if (named == BlobStatus::kTooShort || named == BlobStatus::kChecksum) continue;  // tests above
    EXPECT_TRUE(seen.contains(named)) << describe(named) << " is not tested";
  }
}

TEST(Blob, SelfTestVectorsLieInTheTrainedRangeAndHoldTheModelsOutputs) {
  const model::CalibrationModel model = golden_model();
  const Bytes bytes = golden_bytes();
  BlobView view;
  ASSERT_TRUE(BlobView::open(bytes, view).ok());
  for (std::size_t row = 0; row < view.self_test_count(); ++row) {
    Eigen::MatrixXd x(1, 3);
    for (std::size_t i = 0; i < 3; ++i) {
      x(0, static_cast<int>(i)) = static_cast<double>(view.self_test_input(row, i));
      EXPECT_GE(x(0, static_cast<int>(i)), view.input_min(i));
      EXPECT_LE(x(0, static_cast<int>(i)), view.input_max(i));
    }
    const Eigen::MatrixXd y = model.predict(x);
    const Eigen::MatrixXf single = model::predict_single(model, x.transpose().cast<float>());
    for (std::size_t j = 0; j < 2; ++j) {
      const auto k = static_cast<int>(j);
      EXPECT_DOUBLE_EQ(view.self_test_output(row, j), y(0, k));
      EXPECT_NEAR(static_cast<double>(single(k, 0)), y(0, k), view.self_test_tolerance(j));
      EXPECT_LT(view.self_test_tolerance(j), 1e-4 * view.output_scale(j));
    }
  }
}

TEST(Blob, RefusesModelsThatItCannotHold) {
  const auto message_of = [](const model::CalibrationModel& model) {
    const auto result = model::encode_blob(model);
    return result.ok() ? std::string() : result.error().message;
  };
  model::CalibrationModel model = golden_model();
  model.features[0].channel = "has blank";
  EXPECT_NE(message_of(model).find("'has blank'"), std::string::npos);
  model = golden_model();
  model.features.pop_back();
  EXPECT_NE(message_of(model).find("2 inputs"), std::string::npos);
  model = golden_model();
  model.layers[1].biases.resize(3);
  EXPECT_NE(message_of(model).find("layer 2"), std::string::npos);
  model = golden_model();
  model.layers[0].weights(0, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(message_of(model).empty());
}

TEST(Blob, WritesNothingWhenItCannot) {
  const core::Status status = model::write_blob(golden_model(), "/nonexistent/w.blob");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kIo);
  EXPECT_NE(status.error().message.find("/nonexistent/w.blob"), std::string::npos);
}

TEST(Blob, RefusesAnIndexThatDoesNotFitItsName) {
  Bytes bytes = golden_bytes();
  put(bytes, section(bytes, blob::kFeatures), {7});
  repair_checksum(bytes);
  const auto result = model::decode_blob(bytes, "w.blob");
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("catalogue index 7"), std::string::npos);
}

TEST(Crc32c, MatchesThePublishedVectors) {
  const auto crc = [](const Bytes& bytes) { return blob::crc32c(bytes.data(), bytes.size()); };
  // RFC 3720, B.4.
  EXPECT_EQ(crc(Bytes(32, std::byte{0x00})), 0x8A9136AAU);
  EXPECT_EQ(crc(Bytes(32, std::byte{0xFF})), 0x62A8AB43U);
  Bytes rising(32);
  for (std::size_t i = 0; i < 32; ++i) rising[i] = static_cast<std::byte>(i);
  EXPECT_EQ(crc(rising), 0x46DD794EU);
  const char* const digits = "123456789";
  const auto* const text = reinterpret_cast<const std::byte*>(digits);
  EXPECT_EQ(blob::crc32c(text, 9), 0xE3069283U);
}

}  // namespace
}  // namespace ravencal::test
