// SPDX-License-Identifier: Apache-2.0
//
// Where a model comes from: what recordings and options say, and what happens when they disagree.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "learn/onnx_file.hpp"
#include "learn/onnx_metadata.hpp"
#include "learn/recording_origin.hpp"
#include "learn/train.hpp"
#include "unit/learn/sample_arm.hpp"

namespace ravencal::learn {
namespace {

using model::Arm;
using model::Coordinates;
using model::Origin;
using record::Recording;

Recording arm_with(std::map<std::string, std::string> meta, const std::string& source = "a.db") {
  Recording recording = sample_arm(200, 1);
  recording.meta = std::move(meta);
  recording.source = source;
  return recording;
}

core::Result<TrainResult> train(std::span<const Recording* const> recordings,
                                const Origin& given = {}) {
  TrainOptions options;
  options.hidden.clear();
  options.origin = given;
  return train_model(recordings, {}, options, [](const EpochReport&) { return true; });
}

TEST(Origin, IsThatOfTheRecordings) {
  const Recording recording = arm_with({{"robot", "RAVEN-II"},
                                        {"arm", "green"},
                                        {"controller", "crtk"},
                                        {"coordinates", "corrected"}});
  const Recording* const recordings[] = {&recording};
  EXPECT_FALSE(train(recordings).ok()) << "what is left of an error is not the error";
  Origin given;
  given.coordinates = Coordinates::kCorrected;
  const auto result = train(recordings, given);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->model.origin,
            (Origin{Arm::kGreen, Coordinates::kCorrected, "RAVEN-II", "crtk"}));
}

TEST(Origin, OptionsFillWhatRecordingsDoNotSay) {
  const Recording silent = arm_with({});
  const Recording* const recordings[] = {&silent};
  const auto unknown = train(recordings);
  ASSERT_TRUE(unknown.ok());
  EXPECT_EQ(unknown->model.origin, Origin{});
  const Origin given{Arm::kGold, Coordinates::kMotor, "left", "main"};
  const auto filled = train(recordings, given);
  ASSERT_TRUE(filled.ok());
  EXPECT_EQ(filled->model.origin, given);
}

TEST(Origin, OfASimulationIsInMotorCoordinates) {
  const auto simulated = origin_of(arm_with({{"arm", "gold"}, {"plant_hash", "00ff"}}));
  ASSERT_TRUE(simulated.ok());
  EXPECT_EQ(simulated->coordinates, Coordinates::kMotor);
  const auto imported = origin_of(arm_with({{"arm", "gold"}}));
  ASSERT_TRUE(imported.ok());
  EXPECT_EQ(imported->coordinates, Coordinates::kUnknown);
}

TEST(Origin, ArmsThatAreNotOfARavenAreUnknown) {
  const auto origin = origin_of(arm_with({{"arm", "PSM1"}}));
  ASSERT_TRUE(origin.ok());
  EXPECT_EQ(origin->arm, Arm::kUnknown);
}

TEST(Origin, RecordingsThatDisagreeAreRefusedByFileAndValue) {
  const Recording first = arm_with({{"arm", "gold"}}, "first.db");
  const Recording other = arm_with({{"arm", "green"}}, "other.db");
  const Recording* const both[] = {&first, &other};
  const auto result = train(both);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, core::ErrorCode::kData);
  EXPECT_NE(result.error().message.find("other.db: the arm is 'green', but 'gold'"),
            std::string::npos)
      << result.error().message;
  const Recording* const one[] = {&first};
  Origin given;
  given.arm = Arm::kGreen;
  EXPECT_FALSE(train(one, given).ok()) << "--arm green of a recording of the gold arm";
}

TEST(Origin, CoordinatesThatThereAreNotAreAnError) {
  const auto origin = origin_of(arm_with({{"coordinates", "polar"}}, "p.db"));
  ASSERT_FALSE(origin.ok());
  EXPECT_NE(origin.error().message.find("p.db"), std::string::npos);
  EXPECT_NE(origin.error().message.find("'polar'"), std::string::npos);
}

TEST(Origin, SurvivesTheOnnxFile) {
  const Recording recording = arm_with({{"arm", "green"}, {"robot", "left \"one\""}});
  const Recording* const recordings[] = {&recording};
  auto result = train(recordings, {Arm::kUnknown, Coordinates::kMotor, "", "crtk"});
  ASSERT_TRUE(result.ok()) << result.error().message;
  const auto path = std::filesystem::temp_directory_path() /
                    ("ravencal_origin_" + std::to_string(::getpid()) + ".onnx");
  ASSERT_TRUE(write_onnx(result->model, path).ok());
  const auto read = read_onnx(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->origin, result->model.origin);
}

TEST(LoopGains, SurviveTheMetadataAndWrongOnesAreRefused) {
  const Recording recording = arm_with({});
  const Recording* const recordings[] = {&recording};
  auto result = train(recordings);
  ASSERT_TRUE(result.ok());
  model::LoopGains gains;
  gains.rows = 12;
  gains.channels = {"tau.elbow", "mvel.elbow"};
  gains.largest = Eigen::Matrix2d::Constant(0.25);
  gains.by_group = Eigen::MatrixXd::Constant(2, 3, 0.5);
  result->model.loop_gains = gains;
  Metadata metadata = metadata_of(result->model);
  const auto read = model_from_metadata(metadata);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_TRUE(read->loop_gains.has_value());
  EXPECT_EQ(read->loop_gains->channels, gains.channels);
  EXPECT_EQ(read->loop_gains->largest, gains.largest);
  EXPECT_EQ(read->loop_gains->by_group, gains.by_group);
  EXPECT_EQ(read->loop_gains->rows, 12U);
  for (const char* wrong :
       {"[]", R"({"rows":1})",
        R"({"rows":1,"channels":["a"],"largest":[[1]],"by_group":[[1,1,1]]})",
        R"({"rows":-1,"channels":[],"largest":[[],[]],"by_group":[[0,0,0],[0,0,0]]})",
        R"({"rows":1,"channels":[],"largest":[[],[]],"by_group":[[0,0,0],[0,0,-1]]})"}) {
    metadata["ravencal.gains"] = wrong;
    EXPECT_FALSE(model_from_metadata(metadata).ok()) << wrong;
  }
  metadata.erase("ravencal.gains");
  EXPECT_FALSE(model_from_metadata(metadata)->loop_gains.has_value());
}

TEST(Origin, ModelsWithoutItReadAsUnknownAndWrongOnesAreRefused) {
  const Recording recording = arm_with({{"arm", "green"}});
  const Recording* const recordings[] = {&recording};
  const auto result = train(recordings);
  ASSERT_TRUE(result.ok());
  Metadata metadata = metadata_of(result->model);
  metadata.erase("ravencal.origin");
  const auto older = model_from_metadata(metadata);
  ASSERT_TRUE(older.ok()) << older.error().message;
  EXPECT_EQ(older->origin, Origin{});
  for (const char* wrong : {"[]", "{\"arm\":\"gold\"}",
                            R"({"arm":"blue","robot":"","controller":"","coordinates":"motor"})"}) {
    metadata["ravencal.origin"] = wrong;
    EXPECT_FALSE(model_from_metadata(metadata).ok()) << wrong;
  }
}

}  // namespace
}  // namespace ravencal::learn
