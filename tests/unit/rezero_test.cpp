// SPDX-License-Identifier: Apache-2.0
//
// The constant of a homing from one known pose: the computation, what is refused and why, what is
// read from a recording, and the file beside the weights.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "core/students_t.hpp"
#include "core/temporary_folder.hpp"
#include "core/whole_file.hpp"
#include "model/blob_writer.hpp"
#include "model/homing_constants.hpp"
#include "record/recording.hpp"
#include "rezero/constant.hpp"
#include "rezero/constant_file.hpp"
#include "rezero/pose.hpp"
#include "rezero/reading.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

using model::HomingConstants;
using rezero::JointReading;
using rezero::JointValue;
using rezero::Judgement;
using rezero::KnownJoint;
using rezero::Reading;

constexpr double kDeg = std::numbers::pi / 180.0;

/// Joints 1 to 3 as the robot reads them, and what the weights add.
Reading reading() {
  return {"run.db",
          {{"shoulder", "rad", 40 * kDeg, 0.0, 1 * kDeg},
           {"elbow", "rad", 80 * kDeg, 0.0, -6 * kDeg},
           {"insertion", "m", 0.4, 0.0, 0.01}},
          1.0,
          rezero::Homing{1, 2, 3},
          {}};
}

/// Four homings whose constants lie 1 deg and 1 mm about their mean.
std::vector<HomingConstants> seen() {
  const std::vector<double> angles = {-1.2 * kDeg, -0.3 * kDeg, 0.3 * kDeg, 1.2 * kDeg};
  return {{"shoulder", angles, 0.2 * kDeg},
          {"elbow", angles, 0.2 * kDeg},
          {"insertion", {-0.0012, -0.0003, 0.0003, 0.0012}, 2e-4}};
}

Judgement judged(const std::vector<KnownJoint>& pose, const Reading& of = reading(),
                 const std::vector<HomingConstants>& training = seen(),
                 const std::vector<JointValue>& at_most = {}) {
  return rezero::judge(of, pose, training, at_most);
}

void expect_refused(const Judgement& judgement, const std::string& because) {
  ASSERT_FALSE(judgement.refusals.empty()) << because;
  std::string all;
  for (const std::string& refusal : judgement.refusals) all += refusal + "\n";
  EXPECT_NE(all.find(because), std::string::npos) << all;
}

TEST(Rezero, TheConstantIsWhatReadingAndWeightsLackOfThePose) {
  const Judgement judgement =
      judged({{"elbow", 75 * kDeg, 0.1 * kDeg}, {"insertion", 0.4095, 1e-4}});
  EXPECT_TRUE(judgement.refusals.empty()) << judgement.refusals.front();
  ASSERT_EQ(judgement.joints.size(), 3U);
  EXPECT_FALSE(judgement.joints[0].is_known);
  EXPECT_EQ(judgement.joints[0].constant, 0.0) << "a joint that the pose does not name keeps 0";
  EXPECT_NEAR(judgement.joints[1].constant, 1 * kDeg, 1e-12);
  EXPECT_NEAR(judgement.joints[2].constant, -5e-4, 1e-12);
  EXPECT_NEAR(judgement.joints[1].expected_rest, std::hypot(0.1, 0.2) * kDeg, 1e-12);
  const std::string table = rezero::table_of(judgement);
  EXPECT_NE(table.find("1.0000"), std::string::npos) << table;
}

// Student's t of three degrees of freedom is 3.182.
TEST(Rezero, TheBoundIsTheIntervalOfOneMoreHoming) {
  EXPECT_NEAR(core::one_more(std::vector{-1.0, 0.0, 0.0, 1.0}).half95,
              3.182 * std::sqrt(2.0 / 3.0 * 1.25), 2e-3);
  EXPECT_EQ(core::one_more(std::vector{1.0}).half95, 0.0);
  EXPECT_EQ(core::one_more({}).half95, 0.0);
}

TEST(Rezero, RefusesMoreThanTheHomingsOfTheTraining) {
  expect_refused(judged({{"elbow", 84 * kDeg, 0.1 * kDeg}}), "beyond the");
  expect_refused(judged({{"insertion", 0.42, 1e-4}}), "insertion: the constant of 10 mm");
  EXPECT_TRUE(judged({{"insertion", 0.411, 1e-4}}).refusals.empty());
}

TEST(Rezero, RefusesWhereOneHomingWasSeenUnlessTheUserBoundsIt) {
  const std::vector<KnownJoint> pose = {{"elbow", 75 * kDeg, 0.1 * kDeg}};
  for (const auto& training :
       {std::vector<HomingConstants>{}, {{"elbow", {0.5 * kDeg}, 0.2 * kDeg}}}) {
    expect_refused(judged(pose, reading(), training), "do not say how far homings");
    EXPECT_TRUE(judged(pose, reading(), training, {{"elbow", 2 * kDeg}}).refusals.empty());
    expect_refused(judged(pose, reading(), training, {{"elbow", 0.9 * kDeg}}),
                   "beyond the 0.9 deg");
  }
  // It never widens what the training allows.
  expect_refused(
      judged({{"elbow", 84 * kDeg, 0.1 * kDeg}}, reading(), seen(), {{"elbow", 20 * kDeg}}),
      "beyond the");
}

TEST(Rezero, SaysThatThePoseIsATurnOff) {
  expect_refused(judged({{"elbow", (74.5 + 360) * kDeg, 0.1 * kDeg}}), "1 turn off");
  expect_refused(judged({{"elbow", (74.5 - 180) * kDeg, 0.1 * kDeg}}), "-0.5 turns off");
}

TEST(Rezero, SaysThatThePoseIsOfAnotherJointOrSign) {
  expect_refused(judged({{"shoulder", 74 * kDeg, 0.1 * kDeg}, {"elbow", 41 * kDeg, 0.1 * kDeg}}),
                 "shoulder: the constant of 33 deg");
  expect_refused(judged({{"shoulder", 74 * kDeg, 0.1 * kDeg}, {"elbow", 41 * kDeg, 0.1 * kDeg}}),
                 "fits what the robot reads of shoulder");
  expect_refused(judged({{"shoulder", 74 * kDeg, 0.1 * kDeg}}),
                 "fits what the robot reads of elbow");
  expect_refused(judged({{"elbow", -74.5 * kDeg, 0.1 * kDeg}}), "fits with the other sign");
}

TEST(Rezero, RefusesARobotThatMovesAndAReadingThatIsNone) {
  Reading moving = reading();
  moving.joints[1].range = 0.2 * kDeg;
  expect_refused(judged({{"elbow", 74.5 * kDeg, 0.1 * kDeg}}, moving),
                 "the robot moved during the reading, by 0.2 deg");
  EXPECT_TRUE(judged({{"shoulder", 41 * kDeg, 0.1 * kDeg}}, moving).refusals.empty())
      << "another joint's motion is none of this one's";
  Reading doubted = reading();
  doubted.doubts = {"the pedal was not up all the time"};
  expect_refused(judged({{"elbow", 74.5 * kDeg, 0.1 * kDeg}}, doubted), "the pedal was not up");
  Reading lost = reading();
  lost.joints[1].reading = std::nan("");
  expect_refused(judged({{"elbow", 74.5 * kDeg, 0.1 * kDeg}}, lost), "no number");
  Reading strange = reading();
  strange.confidence = 0.2;
  expect_refused(judged({{"elbow", 74.5 * kDeg, 0.1 * kDeg}}, strange), "know no such pose");
}

TEST(Rezero, RefusesAPoseThatIsNoBetterThanAHoming) {
  expect_refused(judged({{"elbow", 74.5 * kDeg, 3 * kDeg}}), "the pose is uncertain by 3 deg");
}

TEST(Rezero, ReadsThePoseWithUnitsAndUncertainty) {
  const auto model = make_model(4, {});
  const auto pose = rezero::parse_pose(
      std::vector<std::string>{"shoulder=30deg+-0.1deg", "insertion=-400mm±0.2mm"}, model);
  ASSERT_TRUE(pose.ok()) << pose.error().message;
  EXPECT_NEAR(pose.value()[0].value, 30 * kDeg, 1e-12);
  EXPECT_NEAR(pose.value()[0].uncertainty, 0.1 * kDeg, 1e-12);
  EXPECT_NEAR(pose.value()[1].value, -0.4, 1e-12);
  EXPECT_NEAR(pose.value()[1].uncertainty, 2e-4, 1e-12);
  for (const char* wrong : {"shoulder", "shoulder=", "shoulder=30deg", "shoulder=30+-1",
                            "shoulder=30mm+-1mm", "=", "wrist=3deg+-1deg", "shoulder=30deg+--1deg",
                            "shoulder=30deg+-1mm", "shoulder=xdeg+-1deg"}) {
    const auto refused = rezero::parse_pose(std::vector<std::string>{wrong}, model);
    ASSERT_FALSE(refused.ok()) << wrong;
    EXPECT_EQ(refused.error().code, core::ErrorCode::kUsage) << wrong;
  }
  const std::vector<std::string> twice = {"elbow=1deg+-1deg", "elbow=2deg+-1deg"};
  EXPECT_FALSE(rezero::parse_pose(twice, model).ok());
  EXPECT_TRUE(rezero::parse_bounds(std::vector<std::string>{"elbow=2deg"}, model).ok());
  for (const char* wrong : {"elbow=0deg", "elbow=-1deg", "elbow", "elbow=2"}) {
    EXPECT_FALSE(rezero::parse_bounds(std::vector<std::string>{wrong}, model).ok()) << wrong;
  }
}

TEST(Rezero, TheWeightsKeepWhatHomingsLeft) {
  auto model = make_model(4, {});
  ASSERT_TRUE(model::homing_constants_of(model).ok());
  EXPECT_TRUE(model::homing_constants_of(model)->empty()) << "weights of before say nothing";
  model::keep_homing_constants(model, seen());
  const auto bytes = model::encode_blob(model);
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  const auto read = model::decode_blob(bytes.value(), "w.blob");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const auto constants = model::homing_constants_of(read.value());
  ASSERT_TRUE(constants.ok()) << constants.error().message;
  ASSERT_EQ(constants->size(), 3U);
  EXPECT_EQ(constants.value()[1].constants, seen()[1].constants);
  EXPECT_EQ(constants.value()[1].rmse_about_mean, seen()[1].rmse_about_mean);
  for (const char* wrong : {"", "{}", "[1]", R"([{"joint":1}])",
                            R"([{"joint":"elbow","constants":["x"],"rmse_about_mean":1}])"}) {
    model.provenance["homing_constants"] = wrong;
    EXPECT_FALSE(model::homing_constants_of(model).ok()) << wrong;
  }
}

/// A robot that stands from 1 s on, after a move, with encoder offsets.
record::Recording standing(const model::CalibrationModel& model) {
  record::Recording recording;
  recording.source = "r.db";
  std::vector<std::string> names = {"jpos.shoulder", "jpos.elbow", "jpos.insertion"};
  for (const auto& feature : model.features) {
    if (std::find(names.begin(), names.end(), feature.channel) == names.end())
      names.push_back(feature.channel);
  }
  for (const char* joint : {"shoulder", "elbow", "insertion"})
    names.push_back(std::string("enc_offset.") + joint);
  for (const std::string& name : names) {
    record::Channel channel;
    channel.name = name;
    recording.channels.push_back(channel);
  }
  constexpr Eigen::Index kRows = 300;
  recording.samples.resize(kRows, static_cast<Eigen::Index>(names.size()));
  for (Eigen::Index row = 0; row < kRows; ++row) {
    recording.t_ns.push_back(row * 10'000'000);
    recording.samples.row(row).setConstant(0.25);
    if (row < 100) recording.samples(row, 1) = 0.25 + 1e-3 * static_cast<double>(100 - row);
    recording.samples.row(row).tail(3) << 100.0, -200.0, 300.0;
  }
  return recording;
}

TEST(Rezero, ReadsTheSecondOfARecordingInWhichTheRobotStands) {
  const auto model = make_model({plain("jpos.shoulder"), plain("jpos.elbow")}, {});
  const auto recording = standing(model);
  const auto last = rezero::read_recording(recording, model, {});
  ASSERT_TRUE(last.ok()) << last.error().message;
  EXPECT_EQ(last->joints[1].reading, 0.25);
  EXPECT_EQ(last->joints[1].range, 0.0);
  ASSERT_TRUE(last->homing.has_value());
  EXPECT_EQ(*last->homing, (rezero::Homing{100, -200, 300}));
  Eigen::MatrixXd inputs(1, 2);
  inputs << 0.25, 0.25;
  EXPECT_NEAR(last->joints[1].predicted, model.predict(inputs)(0, 1), 1e-6);
  const auto moving = rezero::read_recording(recording, model, 0.0);
  ASSERT_TRUE(moving.ok());
  EXPECT_GT(moving->joints[1].range, 0.09);
  EXPECT_FALSE(rezero::read_recording(recording, model, 100.0).ok()) << "no row lies there";
}

// The reading begins at 2 s; before it the elbow went by 0.1.
TEST(Rezero, RefusesAReadingBeforeTheMemoryOfTheInputsIsKnown) {
  const std::string refusal = "does not hold enough motion before the reading to know ";
  const auto expect = [&](const model::FeatureSpec& feature, bool is_known) {
    const auto model = make_model({plain("jpos.elbow"), feature}, {});
    const auto read = rezero::read_recording(standing(model), model, 1.99);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ASSERT_EQ(read->doubts.empty(), is_known) << feature.text();
    if (is_known) return;
    EXPECT_NE(read->doubts[0].find(refusal + feature.text()), std::string::npos);
  };
  expect(with_play("jpos.elbow", 0.04F), true);
  expect(with_play("jpos.elbow", 0.06F), false);
  expect(mean_of("jpos.shoulder", 0.6F), true);
  expect(mean_of("jpos.shoulder", 0.7F), false);
  expect(travel_mean_of("jpos.shoulder", 0.03F, "jpos.elbow"), true);
  expect(travel_mean_of("jpos.shoulder", 0.04F, "jpos.elbow"), false);
}

TEST(Rezero, ARecordingThatDoesNotTellItsHomingOrIsOfAnotherArm) {
  const auto model = make_model({plain("jpos.shoulder"), plain("jpos.elbow")}, {});
  auto recording = standing(model);
  recording.samples(299, recording.samples.cols() - 1) += 1.0;
  EXPECT_FALSE(rezero::read_recording(recording, model, {})->homing.has_value());
  recording = standing(model);
  recording.channels.back().name = "something";
  EXPECT_FALSE(rezero::read_recording(recording, model, {})->homing.has_value());

  auto gold = model;
  gold.origin.arm = model::Arm::kGold;
  recording.meta["arm"] = "green";
  const auto other = rezero::read_recording(recording, gold, {});
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("green"), std::string::npos) << other.error().message;
  recording.meta = {{"coordinates", "corrected"}};
  EXPECT_FALSE(rezero::read_recording(recording, model, {}).ok()) << "its joints are corrected";
}

TEST(Rezero, TheFileBesideTheWeightsComesBackOrIsRefused) {
  const auto folder = core::TemporaryFolder::create();
  ASSERT_TRUE(folder.ok());
  const auto path = rezero::path_beside(folder->path() / "w.blob");
  EXPECT_EQ(path.filename(), "w.blob.homing.json");
  const rezero::ConstantFile file{
      0x89ABCDEFU, {1, -2, 3}, "r.db", 5, judged({{"elbow", 75 * kDeg, 0.1 * kDeg}}).joints};
  ASSERT_TRUE(rezero::write_constant(file, path).ok());
  EXPECT_TRUE(rezero::is_constant_file(path));
  const auto read = rezero::read_constant(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  const ravencal_homing_constant constant = rezero::for_plugin(read.value());
  EXPECT_EQ(constant.struct_size, sizeof constant);
  EXPECT_EQ(constant.weights_checksum, 0x89ABCDEFU);
  EXPECT_EQ(constant.enc_offset_counts[1], -2);
  EXPECT_EQ(constant.constant_ji[0], 0.0F);
  EXPECT_NEAR(constant.constant_ji[1], 1 * kDeg, 1e-8);

  const std::string text = core::read_whole_file(path).value();
  const auto expect_wrong = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    ASSERT_NE(changed.find(from), std::string::npos) << from;
    changed.replace(changed.find(from), from.size(), to);
    std::ofstream(path) << changed;
    EXPECT_FALSE(rezero::read_constant(path).ok()) << to;
  };
  expect_wrong("\"version\": 1", "\"version\": 2");
  expect_wrong("-2", "-3");
  expect_wrong("ravencal homing constant", "something else");
  expect_wrong("{", "");
  expect_wrong("\"realtime_ns\": 5", "\"realtime_ns\": \"5\"");
}

}  // namespace
}  // namespace ravencal::test
