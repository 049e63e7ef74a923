// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/catalogue.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "model/feature_spec.hpp"

namespace ravencal::model {
namespace {

using record::Channel;
using record::Role;

/// Every channel of raven_state, and the truth of one joint.
std::vector<Channel> raven_channels() {
  std::vector<Channel> channels;
  for (const core::CatalogueEntry& entry : core::catalogue()) {
    channels.push_back({entry.name, entry.si_unit, Role::kFeature, ""});
  }
  channels.push_back({"ext_jpos.elbow", "rad", Role::kJointTruth, "elbow"});
  return channels;
}

std::vector<std::string> selected(std::string_view text,
                                  const std::vector<Channel>& available = raven_channels()) {
  std::vector<std::string> names;
  const auto features = select_features(text, available);
  EXPECT_TRUE(features.ok()) << text << ": " << (features.ok() ? "" : features.error().message);
  if (!features.ok()) return names;
  for (const FeatureSpec& feature : *features) names.push_back(feature.text());
  return names;
}

std::string refusal(std::string_view text,
                    const std::vector<Channel>& available = raven_channels()) {
  const auto features = select_features(text, available);
  if (features.ok()) return "accepted";
  EXPECT_EQ(features.error().code, core::ErrorCode::kUsage);
  return features.error().message;
}

bool has(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

TEST(FeatureSelection, KnowsThePapersHundredAndTwelveInCatalogueOrder) {
  const auto names = selected("paper112");
  EXPECT_EQ(names.size(), 112U);
  EXPECT_EQ(selected(""), names);
}

TEST(FeatureSelection, KnowsTheNotebooksTwoHundredAndEight) {
  const auto names = selected("notebook208");
  EXPECT_EQ(names.size(), 208U);
  EXPECT_FALSE(has(names, "enc.elbow"));
  EXPECT_FALSE(has(names, "enc_offset.elbow"));
  EXPECT_TRUE(has(names, "other.jpos.elbow"));
}

TEST(FeatureSelection, TakesNothingIntoTheLightSetThatCountsFromSwitchingOn) {
  const auto names = selected("light");
  EXPECT_EQ(names.size(), 21U);
  for (const std::string& name : names) {
    EXPECT_EQ(name.find("enc"), std::string::npos) << name;
    EXPECT_EQ(name.find("other"), std::string::npos) << name;
    EXPECT_NE(name, "time");
  }
}

TEST(FeatureSelection, NeverSelectsATruth) {
  EXPECT_FALSE(has(selected("*"), "ext_jpos.elbow"));
  EXPECT_FALSE(has(selected("joint:elbow"), "ext_jpos.elbow"));
  EXPECT_NE(refusal("ext_jpos.elbow"), "accepted");
}

TEST(FeatureSelection, TakesGroupsJointsAndWildcards) {
  EXPECT_EQ(selected("tau.elbow"), std::vector<std::string>{"tau.elbow"});
  EXPECT_EQ(selected("tau.*").size(), 8U);
  EXPECT_EQ(selected("t*w").size(), 1U);
  for (const std::string& name : selected("joint:elbow")) {
    EXPECT_NE(name.find("elbow"), std::string::npos);
  }
  EXPECT_TRUE(has(selected("group:torque"), "tau.elbow"));
  EXPECT_FALSE(has(selected("group:torque"), "mvel.elbow"));
}

TEST(FeatureSelection, AppliesTermsFromLeftToRight) {
  EXPECT_EQ(selected("tau.*,-tau.elbow").size(), 7U);
  EXPECT_EQ(selected("tau.*,-tau.*,tau.elbow"), std::vector<std::string>{"tau.elbow"});
  EXPECT_EQ(selected("tau.elbow,tau.*").front(), "tau.elbow");
  EXPECT_EQ(selected("tau.elbow,tau.elbow").size(), 1U);
  EXPECT_EQ(selected(" tau.elbow , mvel.elbow ").size(), 2U);
}

TEST(FeatureSelection, RemovesFromTheDefaultWhenItBeginsWithARemoval) {
  const auto names = selected("-group:torque");
  EXPECT_FALSE(has(names, "tau.elbow"));
  EXPECT_TRUE(has(names, "jpos.elbow"));
}

TEST(FeatureSelection, TakesAndRemovesLagsAndPlayOperators) {
  EXPECT_EQ(selected("jpos.elbow,jpos.elbow@3,jpos.elbow~0.01").size(), 3U);
  EXPECT_EQ(selected("tau.*@2").size(), 8U);
  EXPECT_EQ(selected("jpos.elbow,jpos.elbow@3,-jpos.elbow@3"),
            std::vector<std::string>{"jpos.elbow"});
  EXPECT_EQ(selected("tau.elbow,jpos.elbow,jpos.elbow@3,jpos.elbow~0.5,-jpos.elbow"),
            std::vector<std::string>{"tau.elbow"});
}

TEST(FeatureSelection, TakesAndRemovesMeans) {
  EXPECT_EQ(selected("jpos.elbow,jpos.elbow%0.5,tau.elbow%abs2"),
            (std::vector<std::string>{"jpos.elbow", "jpos.elbow%0.5", "tau.elbow%abs2"}));
  EXPECT_EQ(selected("tau.*%0.5").size(), 8U);
  EXPECT_EQ(selected("tau.*%abs0.5,-tau.elbow%abs0.5").size(), 7U);
  EXPECT_EQ(selected("tau.elbow%0.5,tau.elbow%abs0.5,-tau.elbow%0.5"),
            std::vector<std::string>{"tau.elbow%abs0.5"});
  EXPECT_EQ(selected("tau.elbow,jpos.elbow%1,jpos.elbow%abs1,-jpos.elbow"),
            std::vector<std::string>{"tau.elbow"});
  EXPECT_NE(refusal("tau.elbow%abs").find("CHANNEL%absSECONDS"), std::string::npos);
  EXPECT_NE(refusal("tau.elbow%2000").find("'2000' is not a time constant from 0.001 to 1000 s"),
            std::string::npos);
}

TEST(FeatureSelection, TakesAndRemovesMeansOverTravel) {
  EXPECT_EQ(selected("tau.elbow%0.1:jpos.elbow,tau.elbow%abs2:mpos.elbow"),
            (std::vector<std::string>{"tau.elbow%0.1:jpos.elbow", "tau.elbow%abs2:mpos.elbow"}));
  EXPECT_EQ(selected("tau.*%0.1:jpos.elbow").size(), 8U);
  EXPECT_EQ(selected("tau.*%0.1:jpos.elbow,-tau.elbow%0.1:jpos.elbow").size(), 7U);
  EXPECT_EQ(selected("mvel.elbow,tau.elbow%0.1:jpos.elbow,-tau.elbow"),
            std::vector<std::string>{"mvel.elbow"});
  EXPECT_EQ(selected("jpos.elbow,tau.elbow%0.1:jpos.elbow,-jpos.elbow"),
            std::vector<std::string>{"tau.elbow%0.1:jpos.elbow"});
  EXPECT_NE(refusal("tau.elbow%0.1:").find("the position's name is missing"), std::string::npos);
  EXPECT_NE(refusal("tau.elbow%0.1:jpos.*").find("'jpos.*' is not the name of one position"),
            std::string::npos);
  EXPECT_NE(refusal("tau.elbow%2000:jpos.elbow").find("'2000' is not a length of travel from"),
            std::string::npos);
  EXPECT_NE(refusal("tau.elbow%0.1:jpos.elbwo").find("needs the position 'jpos.elbwo'"),
            std::string::npos);
  EXPECT_NE(refusal("tau.elbow%0.1:ext_jpos.elbow").find("needs the position 'ext_jpos.elbow'"),
            std::string::npos)
      << "a truth is no position";
}

TEST(FeatureSelection, TakesEverythingButTheTruthOfARecordingThatIsNotARaven) {
  const std::vector<Channel> arm = {{"q1", "rad", Role::kJointEstimate, "j1"},
                                    {"t1", "rad", Role::kJointTruth, "j1"},
                                    {"load", "N", Role::kLoad, ""}};
  EXPECT_EQ(selected("", arm), (std::vector<std::string>{"q1", "load"}));
  EXPECT_EQ(selected("group:joint_pose", arm), std::vector<std::string>{"q1"});
  EXPECT_EQ(selected("joint:j1", arm), std::vector<std::string>{"q1"});
}

TEST(FeatureSelection, NamesTheTermThatIsWrong) {
  EXPECT_NE(refusal("tau.elbow,tua.elbow").find("'tua.elbow' selects nothing"), std::string::npos);
  EXPECT_NE(refusal("group:torques").find("the groups are"), std::string::npos);
  EXPECT_NE(refusal("tau.elbow,,jpos.elbow").find("empty term"), std::string::npos);
  EXPECT_NE(refusal("tau.elbow,").find("ends with a comma"), std::string::npos);
  EXPECT_NE(refusal("tau.elbow,-tau.*").find("leaves no feature"), std::string::npos);
  EXPECT_NE(refusal("-").find("name is missing"), std::string::npos);
  const std::vector<Channel> one = {{"q1", "rad", Role::kJointEstimate, "j1"}};
  EXPECT_NE(refusal("paper112", one).find("needs 112 channels"), std::string::npos);
}

TEST(FeatureSpec, RefusesTextThatIsNoFeature) {
  for (const char* text : {"",         "@3",         "q@",       "q@0",
                           "q@-1",     "q@1.5",      "q@3x",     "q@99999999999",
                           "q~",       "q~0",        "q~-1",     "q~nan",
                           "q~inf",    "q~1e99",     "q~1x",     "q@3~1",
                           "%1",       "q%",         "q%0",      "q%-1",
                           "q%nan",    "q%inf",      "q%0.0009", "q%1000.1",
                           "q%1s",     "q%abs",      "q%abs0",   "q%abs-1",
                           "q%ab1",    "q%1abs",     "q%1%1",    "q%1@3",
                           "%1:p",     "q%1:",       "q%:p",     "q%abs:p",
                           "q%0:p",    "q%-1:p",     "q%nan:p",  "q%inf:p",
                           "q%9e-7:p", "q%1000.1:p", "q%1:p@3",  "q%1:p~1",
                           "q%1:p%1",  "q%1:*",      "q@1:p",    "q~1:p"}) {
    EXPECT_FALSE(FeatureSpec::parse(text).ok()) << text;
  }
}

TEST(FeatureSpec, AddsHistoryOfPlainFeaturesOnly) {
  std::vector<FeatureSpec> features = {
      {"a"}, {"b", Transform::kPlay, 0, 0.5F}, {"c", Transform::kMean, 0, 0.0F, 0.5F}};
  add_history(features, 2, 5);
  ASSERT_EQ(features.size(), 5U);
  EXPECT_EQ(features[3].text(), "a@5");
  EXPECT_EQ(features[4].text(), "a@10");
}

TEST(FeatureSpec, AddsPlayOfPositionsOnly) {
  std::vector<FeatureSpec> features = {{"jpos.elbow"}, {"tau.elbow"}, {"mpos.elbow"}};
  const float half_widths[] = {0.1F, 0.2F};
  add_play(features, half_widths, raven_channels());
  ASSERT_EQ(features.size(), 7U);
  EXPECT_EQ(features[3].text(), "jpos.elbow~0.1");
  EXPECT_EQ(features[6].text(), "mpos.elbow~0.2");
}

record::Recording ramp() {
  record::Recording recording;
  recording.source = "ramp.csv";
  recording.channels = {{"x", "rad", Role::kFeature, ""}, {"y", "rad", Role::kFeature, ""}};
  recording.samples.resize(6, 2);
  recording.samples << 0, 10, 1, 11, 2, 12, 3, 13, 2, 14, 1, 15;
  for (int row = 0; row < 6; ++row) recording.t_ns.push_back(row * 10'000'000LL);
  return recording;
}

std::vector<float> column(const FeatureMatrix& matrix, Eigen::Index index) {
  std::vector<float> values;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) values.push_back(matrix(row, index));
  return values;
}

TEST(FeatureMatrix, HoldsValuesLagsAndPlayOperatorsOfEachRow) {
  const std::vector<FeatureSpec> features = {
      {"y"}, {"x", Transform::kLag, 2}, {"x", Transform::kPlay, 0, 0.5F}};
  const auto matrix = feature_matrix(features, ramp());
  ASSERT_TRUE(matrix.ok());
  EXPECT_EQ(column(*matrix, 0), (std::vector<float>{10, 11, 12, 13, 14, 15}));
  EXPECT_EQ(column(*matrix, 1), (std::vector<float>{0, 0, 0, 1, 2, 3}));
  EXPECT_EQ(column(*matrix, 2), (std::vector<float>{0, 0.5F, 1.5F, 2.5F, 2.5F, 1.5F}));
}

TEST(FeatureMatrix, ForgetsThePastAtEveryEpisode) {
  record::Recording recording = ramp();
  recording.events = {{30'000'000, "episode", ""}, {20'000'000, "homing", ""}};
  const std::vector<FeatureSpec> features = {{"x", Transform::kLag, 2},
                                             {"x", Transform::kPlay, 0, 0.5F},
                                             {"x", Transform::kMean, 0, 0.0F, 1e-3F}};
  const auto matrix = feature_matrix(features, recording);
  ASSERT_TRUE(matrix.ok());
  EXPECT_EQ(column(*matrix, 0), (std::vector<float>{0, 0, 0, 3, 3, 3}));
  EXPECT_EQ(column(*matrix, 1), (std::vector<float>{0, 0.5F, 1.5F, 3, 2.5F, 1.5F}));
  EXPECT_EQ((*matrix)(3, 2), 3.0F);
}

TEST(FeatureMatrix, ReachesBackByTimeWhenTheRecordingHasAnotherRate) {
  const std::vector<FeatureSpec> features = {{"x", Transform::kLag, 1}};
  EXPECT_EQ(column(*feature_matrix(features, ramp(), 0.02), 0),
            (std::vector<float>{0, 0, 0, 1, 2, 3}));
  EXPECT_EQ(column(*feature_matrix(features, ramp(), 0.001), 0),
            (std::vector<float>{0, 0, 1, 2, 3, 2}));
}

TEST(FeatureMatrix, TakesMeansByTheTimeBetweenTheRecordingsRows) {
  const std::vector<FeatureSpec> features = {{"x", Transform::kMean, 0, 0.0F, 0.05F},
                                             {"x", Transform::kMeanOfAbs, 0, 0.0F, 0.05F}};
  record::Recording recording = ramp();
  recording.samples.col(0) *= -1.0;
  const double share = 1.0 - std::exp(-0.01 / 0.05);
  double expected = recording.samples(0, 0);
  // The period of the training does not matter: the recording knows its own.
  const auto matrix = feature_matrix(features, recording, 0.001);
  ASSERT_TRUE(matrix.ok());
  for (Eigen::Index row = 0; row < 6; ++row) {
    expected += share * (recording.samples(row, 0) - expected);
    EXPECT_NEAR((*matrix)(row, 0), expected, 1e-6);
    EXPECT_NEAR((*matrix)(row, 1), -expected, 1e-6);
  }
}

TEST(FeatureMatrix, TakesMeansOverTravelOfAPositionThatIsNoInput) {
  const std::vector<FeatureSpec> features = {
      {.channel = "y", .transform = Transform::kTravelMean, .travel_si = 2.0F, .along = "x"},
      {.channel = "y", .transform = Transform::kTravelMeanOfAbs, .travel_si = 2.0F, .along = "x"}};
  record::Recording recording = ramp();
  recording.samples.col(1) *= -1.0;
  recording.t_ns.assign(6, 0);  // it needs no time
  const auto matrix = feature_matrix(features, recording);
  ASSERT_TRUE(matrix.ok()) << matrix.error().message;
  constexpr double kHalfWidth = 2.0 / 64.0;
  const double travelled[] = {0.0, 1.0 - kHalfWidth, 1.0, 1.0, 1.0 - 2.0 * kHalfWidth, 1.0};
  double expected = -10.0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    const double d = travelled[row];
    expected += d / (d + 2.0) * (recording.samples(row, 1) - expected);
    EXPECT_NEAR((*matrix)(row, 0), expected, 1e-5) << row;
    EXPECT_NEAR((*matrix)(row, 1), -expected, 1e-5) << row;
  }
  recording.events = {{0, "episode", ""}};
  EXPECT_EQ((*feature_matrix(features, recording))(0, 0), -10.0F);
  recording.channels[0].name = "z";
  const auto refused = feature_matrix(features, recording);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message, "ramp.csv: lacks 1 channel(s) that the model needs: x");
}

TEST(FeatureMatrix, NeedsAPeriodForAMean) {
  const std::vector<FeatureSpec> features = {{"x", Transform::kMean, 0, 0.0F, 0.05F}};
  record::Recording recording = ramp();
  recording.t_ns.assign(6, 0);
  const auto refused = feature_matrix(features, recording);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("'x%0.05'"), std::string::npos) << refused.error().message;
  const auto timed = feature_matrix(features, ramp());
  const auto taken = feature_matrix(features, recording, 0.01);
  ASSERT_TRUE(timed.ok() && taken.ok());
  EXPECT_EQ(*timed, *taken);
  record::Recording one = ramp();
  one.samples.conservativeResize(1, Eigen::NoChange);
  one.t_ns.resize(1);
  EXPECT_TRUE(feature_matrix(features, one).ok());
}

TEST(FeatureMatrix, NamesEveryMissingChannelOnce) {
  const std::vector<FeatureSpec> features = {{"x"}, {"u"}, {"v"}, {"u", Transform::kLag, 1}};
  const auto matrix = feature_matrix(features, ramp());
  ASSERT_FALSE(matrix.ok());
  EXPECT_EQ(matrix.error().message, "ramp.csv: lacks 2 channel(s) that the model needs: u, v");
}

TEST(CalibrationModel, PredictsInSiUnits) {
  CalibrationModel model;
  model.features = {{"x"}, {"y"}};
  model.input = {Eigen::Vector2d(1.0, 2.0), Eigen::Vector2d(0.5, 4.0)};
  model.output = {Eigen::VectorXd::Constant(1, 10.0), Eigen::VectorXd::Constant(1, 3.0)};
  DenseLayer hidden{Eigen::MatrixXf(2, 2), Eigen::Vector2f(0.1F, -0.2F), Activation::kSigmoid};
  hidden.weights << 0.5F, -1.0F, 2.0F, 0.25F;
  DenseLayer last{Eigen::MatrixXf(1, 2), Eigen::VectorXf::Constant(1, 0.3F), Activation::kLinear};
  last.weights << 1.5F, -0.5F;
  model.layers = {hidden, last};
  model.outputs = {{"j", "x", "rad"}};
  const Eigen::RowVector2d features(1.25, 6.0);  // scaled: 0.5, 1
  const auto sigmoid = [](double z) { return 1.0 / (1.0 + std::exp(-z)); };
  const double first = sigmoid(0.25 - 1.0 + static_cast<double>(0.1F));
  const double second = sigmoid(1.0 + 0.25 - static_cast<double>(0.2F));
  const double expected = 10.0 + 3.0 * (1.5 * first - 0.5 * second + static_cast<double>(0.3F));
  EXPECT_NEAR(model.predict(features)(0, 0), expected, 1e-12);
}

}  // namespace
}  // namespace ravencal::model
