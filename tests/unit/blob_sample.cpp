// SPDX-License-Identifier: Apache-2.0
#include "unit/blob_sample.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "model/blob_format.hpp"

namespace ravencal::test {

model::CalibrationModel golden_model() {
  using model::Transform;
  model::CalibrationModel model;
  model.features = {{"jpos.elbow", Transform::kValue, 0, 0.0F},
                    {"jpos.elbow", Transform::kLag, 3, 0.0F},
                    {"mpos.shoulder", Transform::kPlay, 0, 0.125F}};
  model.input.mean = Eigen::Vector3d(1.5, 1.5, -2.0);
  model.input.scale = Eigen::Vector3d(0.5, 0.5, 4.0);
  model.input_min = Eigen::Vector3d(1.0, 1.0, -8.0);
  model.input_max = Eigen::Vector3d(2.0, 2.0, 4.0);
  model::TrustRegion trust;
  trust.directions.resize(2, 3);
  trust.directions << 0.6F, 0.8F, 0.0F, 0.0F, 0.0F, 1.0F;
  trust.inverse_variance = Eigen::Vector2f(0.5F, 1.0F);
  trust.inverse_residual_variance = 8.0F;
  trust.full_distance = 4.0F;
  trust.none_distance = 16.0F;
  model.trust = trust;
  model::DenseLayer hidden{Eigen::MatrixXf(2, 3), Eigen::VectorXf(2), model::Activation::kSigmoid};
  hidden.weights << 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F;
  hidden.biases << 0.25F, -0.25F;
  model::DenseLayer last{Eigen::MatrixXf(2, 2), Eigen::VectorXf(2), model::Activation::kLinear};
  last.weights << 1.0F, -1.0F, 0.5F, 2.0F;
  last.biases << 0.0F, 1.0F;
  model.layers = {hidden, last};
  model.output.mean = Eigen::Vector2d(0.125, 0.03125);
  model.output.scale = Eigen::Vector2d(0.015625, 0.0078125);
  model.outputs = {{"elbow", "jpos.elbow", "rad"}, {"insertion", "jpos.insertion", "m"}};
  model.row_period_s = 0.01;
  model.provenance = {{"software_version", "0.1.0"}, {"made_by", "tests/unit/blob_sample.cpp"}};
  return model;
}

model::CalibrationModel golden_model_2_1() {
  model::CalibrationModel model = golden_model();
  model.origin = {model::Arm::kGreen, model::Coordinates::kMotor, "RAVEN-II", "crtk"};
  model::LoopGains gains;
  gains.rows = 1000;
  gains.by_group.resize(2, model::kLoopGroupCount);
  gains.by_group << 0.5, 0.25, 0.125, 0.0, 1.0, 2.0;
  gains.margins = {4.0, 1.5};
  model.loop_gains = gains;
  return model;
}

model::CalibrationModel golden_model_2_2() {
  model::CalibrationModel model = golden_model_2_1();
  model.features[1] = {"jpos.elbow", model::Transform::kMean, 0, 0.0F, 0.5F};
  model.features[2] = {"mpos.shoulder", model::Transform::kMeanOfAbs, 0, 0.0F, 128.0F};
  return model;
}

model::CalibrationModel golden_wide_model() {
  model::CalibrationModel model = golden_model();
  model.layers[0].weights.resize(12, 3);
  model.layers[0].biases.resize(12);
  model.layers[1].weights.resize(2, 12);
  for (int unit = 0; unit < 12; ++unit) {
    // Thirds and sevenths are exact in no precision.
    model.layers[0].weights.row(unit) << static_cast<float>(unit) / 3.0F, -1.0F / 7.0F, 1.0F;
    model.layers[0].biases[unit] = 0.25F * static_cast<float>(unit);
    model.layers[1].weights.col(unit) << 1.0F / 3.0F, static_cast<float>(unit);
  }
  return model;
}

model::Packing golden_packing(model::packed::Precision precision) {
  model::Packing packing{precision, {}};
  packing.inputs = {{Eigen::Vector3f(0.25F, 0.0F, -0.5F), 3.0F},
                    {Eigen::VectorXf::Constant(12, 0.5F), 1.0F}};
  return packing;
}

std::vector<std::byte> golden_bytes(const std::string& name) {
  const auto path = std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tests" / "golden" / name;
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  return {bytes, bytes + text.size()};
}

void repair_checksum(std::vector<std::byte>& bytes) {
  if (bytes.size() < model::blob::kTrailerBytes) return;
  const std::size_t trailer = bytes.size() - model::blob::kTrailerBytes;
  const std::uint32_t crc = model::blob::crc32c(bytes.data(), trailer);
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[trailer + i] = static_cast<std::byte>((crc >> (8 * i)) & 0xFFU);
  }
}

}  // namespace ravencal::test
