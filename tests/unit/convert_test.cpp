// SPDX-License-Identifier: Apache-2.0
//
// `ravencal convert` in every precision: what it writes, what it says, what it refuses.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "learn/onnx_file.hpp"
#include "model/blob_writer.hpp"
#include "model/single_precision.hpp"
#include "record/recording_writer.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

/// One input, 40 and 20 hidden units: the correction of joint "elbow" from its own estimate.
model::CalibrationModel sample_model() {
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  const auto draw = [&] { return normal(random); };
  model::CalibrationModel model;
  model.features = {{"jpos.elbow", model::Transform::kValue, 0, 0.0F}};
  model.input = {Eigen::VectorXd::Constant(1, 1.0), Eigen::VectorXd::Constant(1, 0.5)};
  model.input_min = Eigen::VectorXd::Constant(1, 0.0);
  model.input_max = Eigen::VectorXd::Constant(1, 2.0);
  model.layers = {{Eigen::MatrixXf::NullaryExpr(40, 1, draw),
                   Eigen::VectorXf::NullaryExpr(40, draw), model::Activation::kSigmoid},
                  {Eigen::MatrixXf::NullaryExpr(20, 40, draw),
                   Eigen::VectorXf::NullaryExpr(20, draw), model::Activation::kSigmoid},
                  {Eigen::MatrixXf::NullaryExpr(1, 20, draw), Eigen::VectorXf::NullaryExpr(1, draw),
                   model::Activation::kLinear}};
  model.output = {Eigen::VectorXd::Constant(1, 0.1), Eigen::VectorXd::Constant(1, 0.02)};
  model.outputs = {{"elbow", "jpos.elbow", "rad"}};
  model.row_period_s = 0.01;
  return model;
}

/// A recording whose truth is what the model says plus noise of `noise_rad`: the smaller the noise,
/// the more the rounding of weights shows.
record::Recording sample_recording(double noise_rad) {
  constexpr int kRows = 2000;
  std::mt19937 random(9);
  std::normal_distribution<double> normal(0.0, noise_rad);
  record::Recording recording;
  recording.channels = {{"truth.elbow", "rad", record::Role::kJointTruth, "elbow"},
                        {"jpos.elbow", "rad", record::Role::kJointEstimate, "elbow"}};
  Eigen::MatrixXf x(1, kRows);
  for (int row = 0; row < kRows; ++row) x(0, row) = 2.0F * static_cast<float>(row) / kRows;
  const Eigen::MatrixXf error = model::predict_single(sample_model(), x);
  recording.samples.resize(kRows, 2);
  for (int row = 0; row < kRows; ++row) {
    recording.t_ns.push_back(row * std::int64_t{10'000'000});
    const auto estimate = static_cast<double>(x(0, row));
    recording.samples(row, 1) = estimate;
    recording.samples(row, 0) = estimate + static_cast<double>(error(0, row)) + normal(random);
  }
  return recording;
}

class Convert : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    ASSERT_TRUE(learn::write_onnx(sample_model(), folder_ / "m.onnx").ok());
    ASSERT_TRUE(record::write_recording(sample_recording(1e-3), folder_ / "noisy.db", true).ok());
    ASSERT_TRUE(record::write_recording(sample_recording(1e-7), folder_ / "exact.db", true).ok());
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// `ravencal convert m.onnx --force --out w.blob OPTIONS`, run in the folder.
  [[nodiscard]] Outcome convert(const std::string& options) const {
    const std::string command =
        fmt::format("cd '{}' && '{}' convert m.onnx --force --out w.blob {} 2>&1", folder_.string(),
                    RAVENCAL_PROGRAM, options);
    return run_command(command);
  }
  [[nodiscard]] bool written() const {
    const auto files = fs::directory_iterator(folder_);
    return std::any_of(begin(files), end(files), [](const fs::directory_entry& file) {
      return file.path().filename().string().starts_with("w.blob");
    });
  }

  fs::path folder_ =
      fs::temp_directory_path() / fmt::format("ravencal_convert_test_{}", ::getpid());
};

TEST_F(Convert, WritesEveryPrecisionAndShowsTheChangeOfRmse) {
  std::size_t bytes = SIZE_MAX;
  for (const char* precision : {"f32", "bf16", "int8"}) {
    const Outcome outcome = convert(fmt::format("--precision {} --check noisy.db", precision));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    EXPECT_NE(outcome.text.find("RMSE"), std::string::npos) << outcome.text;
    EXPECT_NE(outcome.text.find(fmt::format("bytes, {},", precision)), std::string::npos);
    const auto json = model::describe_blob_json(folder_ / "w.blob");
    ASSERT_TRUE(json.ok());
    EXPECT_NE(json->find(fmt::format("\"precision\": \"{}\"", precision)), std::string::npos);
    const auto size = static_cast<std::size_t>(fs::file_size(folder_ / "w.blob"));
    EXPECT_LT(size, bytes) << precision << " must be smaller than the one before";
    bytes = size;
  }
}

TEST_F(Convert, RefusesWeightsThatCostTooMuchAndWritesNothing) {
  for (const char* precision : {"bf16", "int8"}) {
    const Outcome outcome = convert(fmt::format("--precision {} --check exact.db", precision));
    EXPECT_EQ(outcome.exit_code, 1) << outcome.text;
    EXPECT_NE(outcome.text.find("above 2 %"), std::string::npos) << outcome.text;
    EXPECT_NE(outcome.text.find("not written"), std::string::npos) << outcome.text;
    EXPECT_FALSE(written());
  }
  EXPECT_EQ(convert("--precision bf16 --check exact.db --max-rmse-change 1e9").exit_code, 0);
}

TEST_F(Convert, CompactsWithinItsBudgetAndSaysWhatIsLeft) {
  const Outcome whole = convert("--check noisy.db --json");
  ASSERT_EQ(whole.exit_code, 0) << whole.text;
  const Outcome exact = convert("--compact --check exact.db --max-rmse-change 0");
  EXPECT_EQ(exact.exit_code, 0) << exact.text;
  EXPECT_NE(exact.text.find("860 of 860 weights"), std::string::npos) << exact.text;
  for (const char* precision : {"f32", "int8"}) {
    const Outcome small = convert(fmt::format(
        "--compact 0.02 --precision {} --calibrate exact.db --check noisy.db --json", precision));
    ASSERT_EQ(small.exit_code, 0) << small.text;
    const auto before = nlohmann::json::parse(whole.text);
    const auto after = nlohmann::json::parse(small.text);
    EXPECT_LT(after["bytes_per_step"].get<int>() * 4, before["bytes_per_step"].get<int>());
    EXPECT_LE(after["compact"]["output_change"].get<double>(), 0.02);
    EXPECT_LE(after["check"]["joints"][0]["rmse_change_percent"].get<double>(), 2.0);
    EXPECT_EQ(after["bytes_per_step_f32"], before["bytes_per_step"]);
  }
}

TEST_F(Convert, RefusesACompactNetworkThatCostsTooMuchAndOneWithoutRows) {
  const Outcome costly = convert("--compact 0.5 --check exact.db");
  EXPECT_EQ(costly.exit_code, 1) << costly.text;
  EXPECT_NE(costly.text.find("above 2 %"), std::string::npos) << costly.text;
  EXPECT_FALSE(written());
  const Outcome rowless = convert("--compact 0.02");
  EXPECT_EQ(rowless.exit_code, 2) << rowless.text;
  EXPECT_NE(rowless.text.find("--calibrate"), std::string::npos) << rowless.text;
}

TEST_F(Convert, F32ChangesNothing) {
  const Outcome outcome = convert("--check exact.db --max-rmse-change 0");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("+0.000 %"), std::string::npos) << outcome.text;
}

TEST_F(Convert, Int8NeedsARecordingAndSaysWhichItUsed) {
  const Outcome none = convert("--precision int8");
  EXPECT_EQ(none.exit_code, 2) << none.text;
  EXPECT_NE(none.text.find("--calibrate"), std::string::npos) << none.text;
  EXPECT_FALSE(written());
  const Outcome both = convert("--precision int8 --calibrate exact.db --check noisy.db");
  EXPECT_EQ(both.exit_code, 0) << both.text;
  EXPECT_NE(both.text.find("calibrated on exact.db"), std::string::npos) << both.text;
}

TEST_F(Convert, SaysAtOnceWhatNoPluginCanLoad) {
  model::CalibrationModel jaw = sample_model();
  jaw.outputs[0].joint = "jaw";
  model::CalibrationModel foreign = sample_model();
  foreign.features[0].channel = "current.jaw";
  const std::pair<const model::CalibrationModel*, const char*> cases[] = {
      {&jaw, "it corrects 'jaw', and a plugin corrects shoulder, elbow, insertion"},
      {&foreign, "no robot state has its inputs current.jaw"}};
  for (const auto& [model, why] : cases) {
    ASSERT_TRUE(learn::write_onnx(*model, folder_ / "m.onnx").ok());
    const Outcome outcome = convert("");
    EXPECT_EQ(outcome.exit_code, 2) << outcome.text;
    EXPECT_NE(outcome.text.find(why), std::string::npos) << outcome.text;
    EXPECT_NE(outcome.text.find("Any ONNX runtime"), std::string::npos) << outcome.text;
    EXPECT_FALSE(written());
  }
}

TEST_F(Convert, NamesWhatARecordingLacks) {
  record::Recording recording = sample_recording(1e-3);
  recording.channels[0].role = record::Role::kFeature;
  recording.channels[0].joint.clear();
  ASSERT_TRUE(record::write_recording(recording, folder_ / "untrue.db").ok());
  const Outcome outcome = convert("--precision bf16 --check untrue.db");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
  EXPECT_NE(outcome.text.find("joint elbow"), std::string::npos) << outcome.text;
  EXPECT_FALSE(written());
}

}  // namespace
}  // namespace ravencal::test
