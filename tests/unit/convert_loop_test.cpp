// SPDX-License-Identifier: Apache-2.0
//
// `ravencal convert` and the loop that a model closes: origin, gains, margins, refusals.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "learn/onnx_file.hpp"
#include "model/blob_writer.hpp"
#include "record/recording_writer.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// error of the elbow = gain * tau.elbow, one linear layer; the inputs' scale is 1.
model::CalibrationModel torque_model(double gain) {
  model::CalibrationModel model;
  model.features = {{"tau.elbow"}, {"jpos.elbow"}};
  model.input = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones()};
  model.input_min = Eigen::Vector2d::Constant(-2.0);
  model.input_max = Eigen::Vector2d::Constant(2.0);
  Eigen::MatrixXf weights(1, 2);
  weights << static_cast<float>(gain), 0.0F;
  model.layers = {{weights, Eigen::VectorXf::Zero(1), model::Activation::kLinear}};
  model.output = {Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1)};
  model.outputs = {{"elbow", "jpos.elbow", "rad"}};
  model.row_period_s = 0.01;
  return model;
}

record::Recording motion(const std::string& arm) {
  constexpr int kRows = 300;
  record::Recording recording;
  recording.meta = {{"robot", "RAVEN-II"}, {"arm", arm}};
  recording.channels = {{"truth.elbow", "rad", record::Role::kJointTruth, "elbow"},
                        {"jpos.shoulder", "rad", record::Role::kJointEstimate, "shoulder"},
                        {"jpos.elbow", "rad", record::Role::kJointEstimate, "elbow"},
                        {"jpos.insertion", "m", record::Role::kJointEstimate, "insertion"},
                        {"tau.elbow", "N_m", record::Role::kDriveTorque, "elbow"}};
  recording.samples.resize(kRows, 5);
  for (int row = 0; row < kRows; ++row) {
    recording.t_ns.push_back(row * std::int64_t{10'000'000});
    const double swing = std::sin(0.05 * row);
    recording.samples.row(row) << 1.6, 0.5, 1.6 + 0.1 * swing, 0.4, 0.3 * swing;
  }
  return recording;
}

class ConvertLoop : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    ASSERT_TRUE(record::write_recording(motion("gold"), folder_ / "train.db", true).ok());
    ASSERT_TRUE(record::write_recording(motion("green"), folder_ / "green.db", true).ok());
    // Of hand: kp 0.3 N m/rad times 121.5 is a loop of 1 at 0.0274 rad per N m, with a stiff servo.
    write("soft.onnx", torque_model(0.002));
    write("steep.onnx", torque_model(0.2));
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const model::CalibrationModel& model) const {
    ASSERT_TRUE(learn::write_onnx(model, folder_ / name).ok());
  }
  /// `ravencal convert ARGUMENTS --out w.blob`, run in the folder.
  [[nodiscard]] Outcome convert(const std::string& arguments) const {
    fs::remove(folder_ / "w.blob");
    return run_command(fmt::format("cd '{}' && '{}' convert {} --out w.blob 2>&1", folder_.string(),
                                   RAVENCAL_PROGRAM, arguments));
  }
  void expect_refusal(const std::string& arguments, int exit_code, const std::string& says) const {
    const Outcome outcome = convert(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.text;
    EXPECT_NE(outcome.text.find(says), std::string::npos) << arguments << "\n" << outcome.text;
    EXPECT_FALSE(fs::exists(folder_ / "w.blob")) << arguments;
  }
  [[nodiscard]] model::CalibrationModel weights() const {
    const auto blob = model::read_blob(folder_ / "w.blob");
    EXPECT_TRUE(blob.ok()) << (blob.ok() ? "" : blob.error().message);
    return blob.ok() ? *blob : model::CalibrationModel();
  }

  const std::string plant_ = std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml";
  fs::path folder_ =
      fs::temp_directory_path() / fmt::format("ravencal_convert_loop_test_{}", ::getpid());
};

TEST_F(ConvertLoop, RefusesALoopWhoseGainsNobodyComputed) {
  expect_refusal("soft.onnx", 2, "tau.elbow");
  expect_refusal("soft.onnx", 2, "--calibrate");
  const Outcome forced = convert("soft.onnx --unbounded-loop");
  EXPECT_EQ(forced.exit_code, 0) << forced.text;
  EXPECT_FALSE(weights().loop_gains.has_value());
  EXPECT_NE(weights().provenance.at("loop").find("--unbounded-loop"), std::string::npos);
}

TEST_F(ConvertLoop, TakesTheGainsOfTheTraining) {
  model::CalibrationModel trained = torque_model(0.002);
  model::LoopGains gains;
  gains.rows = 7;
  gains.channels = {"tau.elbow"};
  gains.largest = Eigen::MatrixXd::Constant(1, 1, 0.002);
  gains.by_group = Eigen::RowVector3d(0.002, 0.0, 0.0);
  trained.loop_gains = gains;
  write("trained.onnx", trained);
  const Outcome outcome = convert("trained.onnx");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_EQ(weights().loop_gains->rows, 7U);
  EXPECT_NE(outcome.text.find("over 7 rows"), std::string::npos) << outcome.text;
}

TEST_F(ConvertLoop, ComputesTheGainsAtTheRecordingsOfTheTraining) {
  const Outcome outcome = convert("soft.onnx --calibrate train.db --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  const json loop = json::parse(outcome.text)["loop"];
  EXPECT_EQ(loop["rows"], 300);
  EXPECT_NEAR(loop["gains"]["elbow"]["by_channel"]["tau.elbow"].get<double>(), 0.002, 1e-9);
  EXPECT_NEAR(weights().loop_gains->by_group(0, 0), 0.002, 1e-9);
}

TEST_F(ConvertLoop, AModelWithoutSuchInputsNeedsNoGains) {
  model::CalibrationModel open = torque_model(0.1);
  open.features = {{"jpos.shoulder"}, {"jpos.elbow"}};
  write("open.onnx", open);
  const Outcome outcome = convert("open.onnx");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("no input answers"), std::string::npos) << outcome.text;
}

TEST_F(ConvertLoop, RefusesTooSmallMarginsWithAPlantsServo) {
  expect_refusal(fmt::format("steep.onnx --calibrate train.db --plant '{}'", plant_), 1,
                 "gain margin");
  const Outcome forced =
      convert(fmt::format("steep.onnx --calibrate train.db --plant '{}' --unbounded-loop", plant_));
  ASSERT_EQ(forced.exit_code, 0) << forced.text;
  EXPECT_LT(weights().loop_gains->margins->gain, 1.0);
  const Outcome soft = convert(fmt::format("soft.onnx --calibrate train.db --plant '{}'", plant_));
  ASSERT_EQ(soft.exit_code, 0) << soft.text;
  EXPECT_GT(weights().loop_gains->margins->gain, 2.0);
  EXPECT_NE(soft.text.find("Hz"), std::string::npos) << soft.text;
}

TEST_F(ConvertLoop, AsksForRecordingsToComputeMarginsAt) {
  model::CalibrationModel open = torque_model(0.0);
  open.features = {{"jpos.shoulder"}, {"jpos.elbow"}};
  write("open.onnx", open);
  expect_refusal(fmt::format("open.onnx --plant '{}'", plant_), 2, "--calibrate or --check");
  expect_refusal("soft.onnx --calibrate train.db --plant none.toml", 3, "none.toml");
}

TEST_F(ConvertLoop, PutsTheOriginIntoTheWeights) {
  const Outcome outcome =
      convert("soft.onnx --calibrate train.db --controller crtk --coordinates motor");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_EQ(weights().origin,
            (model::Origin{model::Arm::kGold, model::Coordinates::kMotor, "RAVEN-II", "crtk"}));
  const auto words = model::describe_blob(folder_ / "w.blob");
  ASSERT_TRUE(words.ok());
  EXPECT_NE(words->find("gold arm of RAVEN-II, controller crtk, inputs in motor coordinates"),
            std::string::npos)
      << *words;
}

TEST_F(ConvertLoop, RefusesOriginsThatDisagree) {
  expect_refusal("soft.onnx --calibrate train.db green.db", 3, "green.db: the arm is 'green'");
  expect_refusal("soft.onnx --calibrate train.db --arm green", 3, "the arm is 'gold'");
}

}  // namespace
}  // namespace ravencal::test
