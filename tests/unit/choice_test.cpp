// SPDX-License-Identifier: Apache-2.0
//
// `train` without a method: what is offered, what is chosen, and that the one network it becomes
// computes what the chosen candidates do.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "choice/assemble.hpp"
#include "choice/choice_table.hpp"
#include "choice/choose.hpp"
#include "choice/input_sets.hpp"
#include "choice/rows.hpp"
#include "core/catalogue.hpp"
#include "learn/dataset.hpp"
#include "learn/evaluate.hpp"

namespace ravencal::choice {
namespace {

using record::Recording;
using record::Role;

constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

/// Error of an elbow, from its position, its play of half-width 0.1 and its torque.
using ErrorLaw = std::function<double(double position, double play, double torque)>;

/// An elbow that moves to and fro with falling and rising amplitude at 100 Hz, a torque, and
/// channels that must not become inputs. The law's noise is 0.001 rad.
Recording elbow(int rows, unsigned seed, const ErrorLaw& law) {
  Recording arm;
  arm.source = "elbow.db";
  arm.channels = {{"elbow.estimate", "rad", Role::kJointEstimate, "elbow"},
                  {"elbow.truth", "rad", Role::kJointTruth, "elbow"},
                  {"elbow.torque", "N_m", Role::kDriveTorque, "elbow"},
                  {"elbow.sensor", "N_m", Role::kLoad, "elbow"},
                  {"elbow.desired", "rad", Role::kDesiredPosition, "elbow"},
                  {"elbow.speed", "rad_per_s", Role::kMotorVelocity, "elbow"}};
  arm.samples.resize(rows, 6);
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  double play = 0.0;
  double torque = 0.0;
  for (int row = 0; row < rows; ++row) {
    const double t = 0.01 * row;
    const double position = (0.6 + 0.3 * std::sin(0.11 * t + seed)) * std::sin(0.9 * t + seed);
    play = row == 0 ? position : std::clamp(play, position - 0.1, position + 0.1);
    torque += 0.02 * (unit(generator) - torque);
    const double error = law(position, play, torque) + 0.001 * unit(generator);
    arm.t_ns.push_back(row * 10'000'000LL);
    arm.samples.row(row) << position, position + error, torque, error, position + 0.1 * error, 0.0;
  }
  return arm;
}

const ErrorLaw kLinear = [](double q, double, double) { return 0.05 + 0.1 * q; };
const ErrorLaw kPlay = [](double q, double play, double) { return 0.05 + 0.4 * (play - q); };
const ErrorLaw kCurve = [](double q, double, double) { return 0.2 * std::sin(3.0 * q); };

bool go_on(double, const std::string&) { return true; }

core::Result<Choice> choose(const std::vector<Recording>& recordings,
                            const ChoiceOptions& options = {}) {
  std::vector<const Recording*> pointers;
  for (const Recording& recording : recordings) pointers.push_back(&recording);
  return choose_model(pointers, options, go_on);
}

double rmse_on(const model::CalibrationModel& model, const Recording& recording) {
  const Recording* const recordings[] = {&recording};
  const auto evaluation = learn::evaluate(model, recordings);
  EXPECT_TRUE(evaluation.ok()) << evaluation.error().message;
  return evaluation->joints[0].calibrated.rmse;
}

/// Names of the chosen candidates.
std::string chosen(const JointChoice& joint) {
  std::string names;
  for (const TriedModel& tried : joint.tried) {
    if (tried.weight > 0.0) names += tried.name + ";";
  }
  return names;
}

TEST(Choice, CorrectsAJointThatNeverMovesByItsMeanAndTheOthersAsEver) {
  Recording arm = elbow(3000, 1, kPlay);
  for (const char* channel : {"estimate", "truth", "torque"}) {
    record::Channel held = arm.channels[*arm.column("elbow." + std::string(channel))];
    held.name = "wrist." + std::string(channel);
    held.joint = "wrist";
    arm.channels.push_back(held);
  }
  arm.samples.conservativeResize(Eigen::NoChange, 9);
  arm.samples.col(6).setConstant(0.3);
  arm.samples.col(7).setConstant(0.32);
  arm.samples.col(8) = arm.samples.col(2);
  const auto choice = choose({arm});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  ASSERT_EQ(choice->joints.size(), 2U);
  EXPECT_EQ(choice->joints[1].tried.size(), 1U) << "bias alone";
  ASSERT_EQ(choice->warnings.size(), 1U);
  EXPECT_NE(choice->warnings[0].find("joint wrist never moves"), std::string::npos);
  EXPECT_LT(rmse_on(choice->model, arm), 0.004);
}

TEST(Choice, OfALinearErrorIsLinearAndReachesTheNoise) {
  const auto choice = choose({elbow(3000, 1, kLinear), elbow(3000, 2, kLinear)});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_EQ(chosen(choice->joints[0]), "linear, own inputs as they are;");
  ASSERT_EQ(choice->model.layers.size(), 1U);
  EXPECT_LT(rmse_on(choice->model, elbow(2000, 3, kLinear)), 0.0008);  // noise: 0.00058
}

TEST(Choice, OfAnErrorWithMemoryRemembers) {
  const auto choice = choose({elbow(6000, 1, kPlay), elbow(6000, 2, kPlay)});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_NE(chosen(choice->joints[0]).find("memory"), std::string::npos);
  const Recording test = elbow(4000, 3, kPlay);
  ChoiceOptions without_memory;
  without_memory.features = "elbow.estimate";
  const auto forgetful = choose({elbow(6000, 1, kPlay)}, without_memory);
  ASSERT_TRUE(forgetful.ok());
  EXPECT_LT(rmse_on(choice->model, test), 0.35 * rmse_on(forgetful->model, test));
}

TEST(Choice, OfACurvedErrorHasUnits) {
  const auto choice = choose({elbow(6000, 1, kCurve), elbow(6000, 2, kCurve)});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_NE(chosen(choice->joints[0]).find("units"), std::string::npos);
  ASSERT_EQ(choice->model.layers.size(), 2U);
  const Recording test = elbow(4000, 3, kCurve);
  ChoiceOptions line;
  line.kinds = Kinds::kLinear;
  const auto linear = choose({elbow(6000, 1, kCurve)}, line);
  ASSERT_TRUE(linear.ok());
  EXPECT_LT(rmse_on(choice->model, test), 0.1 * rmse_on(linear->model, test));
}

TEST(Choice, OfAConstantErrorIsTheConstant) {
  Recording arm = elbow(3000, 1, kLinear);
  arm.samples.col(1) = arm.samples.col(0).array() + 0.03;
  const auto choice = choose({arm});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_EQ(chosen(choice->joints[0]), "bias removed;");
  EXPECT_LT(rmse_on(choice->model, arm), 1e-6);
}

TEST(Choice, OfFewRowsIsRefused) {
  ASSERT_TRUE(choose({elbow(static_cast<int>(learn::kFewestRows), 1, kLinear)}).ok());
  const auto refused = choose({elbow(static_cast<int>(learn::kFewestRows) - 1, 1, kLinear)});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("joint elbow: 49 usable row(s) are too few"),
            std::string::npos)
      << refused.error().message;
}

TEST(Choice, IsTheSameForTheSameSeed) {
  ChoiceOptions options;
  options.kinds = Kinds::kUnits;
  const std::vector<Recording> training = {elbow(3000, 1, kCurve)};
  const auto first = choose(training, options);
  const auto second = choose(training, options);
  options.seed = 4;
  const auto other = choose(training, options);
  ASSERT_TRUE(first.ok() && second.ok() && other.ok());
  EXPECT_EQ(first->model.layers[0].weights, second->model.layers[0].weights);
  EXPECT_EQ(first->model.layers[1].weights, second->model.layers[1].weights);
  EXPECT_NE(first->model.layers[0].weights, other->model.layers[0].weights);
}

TEST(Choice, TakesJointsWhoseTruthsAreKnownInDifferentRows) {
  Recording arm = elbow(4000, 1, kLinear);
  arm.channels.push_back({"wrist.estimate", "rad", Role::kJointEstimate, "wrist"});
  arm.channels.push_back({"wrist.truth", "rad", Role::kJointTruth, "wrist"});
  arm.samples.conservativeResize(Eigen::NoChange, 8);
  arm.samples.col(6) = -arm.samples.col(0);
  arm.samples.col(7) = arm.samples.col(6).array() - 0.3;
  arm.samples.col(1).head(2000).setConstant(kLost);
  arm.samples.col(7).tail(2000).setConstant(kLost);
  const auto choice = choose({arm});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  ASSERT_EQ(choice->model.outputs.size(), 2U);
  EXPECT_NEAR(choice->model.output.mean[1], -0.3, 1e-9);
  const Recording* const recordings[] = {&arm};
  const auto rows = make_rows(choice->model.features, choice->model.outputs, recordings, 0.01);
  ASSERT_TRUE(rows.ok());
  const Eigen::MatrixXd left = rows->errors - choice->model.predict(rows->inputs.cast<double>());
  EXPECT_LT(left.col(0).tail(2000).cwiseAbs().maxCoeff(), 0.003);
  EXPECT_LT(left.col(1).head(2000).cwiseAbs().maxCoeff(), 0.003);
}

TEST(Choice, KeepsThePositionOfAMeanOverTravelAmongTheInputs) {
  Recording arm = elbow(3000, 1, kLinear);
  arm.samples.col(1) = arm.samples.col(0) + 0.05 * arm.samples.col(2);
  ChoiceOptions options;
  options.features = "elbow.estimate,elbow.torque%0.001:elbow.estimate";
  const auto choice = choose({arm}, options);
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  std::vector<std::string> texts;
  for (const model::FeatureSpec& feature : choice->model.features) texts.push_back(feature.text());
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "elbow.estimate"), 1);
  EXPECT_EQ(texts.size(), 2U);
}

TEST(Choice, SaysWhichJointHasNoTruth) {
  Recording arm = elbow(300, 1, kLinear);
  arm.samples.col(1).setConstant(kLost);
  const auto choice = choose({arm});
  ASSERT_FALSE(choice.ok());
  EXPECT_NE(choice.error().message.find("joint elbow"), std::string::npos)
      << choice.error().message;
}

TEST(Choice, EndsWithWhatWasTriedWhenStopped) {
  const Recording arm = elbow(2000, 1, kCurve);
  const Recording* const recordings[] = {&arm};
  int asked = 0;
  const auto choice =
      choose_model(recordings, {}, [&](double, const std::string&) { return ++asked <= 1; });
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_TRUE(choice->interrupted);
  EXPECT_EQ(choice->joints[0].tried.size(), 2U);  // the bias and one candidate
  EXPECT_LT(rmse_on(choice->model, arm), 0.2);
}

TEST(Choice, TableNamesEveryJointCandidateAndChoice) {
  const auto choice = choose({elbow(2000, 1, kLinear)});
  ASSERT_TRUE(choice.ok());
  const std::string table = choice_table(*choice);
  for (const char* words : {"elbow, RMSE in deg", "95 % interval", "outside", "bias removed",
                            "1.00", "elbow: linear, own inputs as they are"}) {
    EXPECT_NE(table.find(words), std::string::npos) << words << " is missing in\n" << table;
  }
}

TEST(OfferedInputs, LeaveOutTruthLoadsDesiredValuesAndVelocities) {
  const Recording arm = elbow(500, 1, kLinear);
  const Recording* const recordings[] = {&arm};
  const auto sets = offered_inputs(recordings, {{{"elbow", "elbow.estimate", "rad"}}});
  ASSERT_TRUE(sets.ok()) << sets.error().message;
  for (const model::FeatureSpec& feature : sets->features) {
    EXPECT_TRUE(feature.channel == "elbow.estimate" || feature.channel == "elbow.torque")
        << feature.text();
  }
}

TEST(OfferedInputs, OnARavenCloseNoLoop) {
  Recording arm = elbow(500, 1, kLinear);
  arm.channels[0] = {"jpos.elbow", "rad", Role::kJointEstimate, "elbow"};
  arm.channels[2] = {"tau.elbow", "N_m", Role::kDriveTorque, "elbow"};
  ASSERT_TRUE(core::catalogue_index_of("tau.elbow").has_value());
  const Recording* const recordings[] = {&arm};
  const auto sets = offered_inputs(recordings, {{{"elbow", "jpos.elbow", "rad"}}});
  ASSERT_TRUE(sets.ok());
  for (const model::FeatureSpec& feature : sets->features) EXPECT_EQ(feature.channel, "jpos.elbow");
}

TEST(HeldOut, PartsHoldEveryRowOnceAndTheOutermostHalfLast) {
  std::vector<Recording> recordings;
  for (unsigned seed = 1; seed <= 5; ++seed) recordings.push_back(elbow(200, seed, kLinear));
  std::vector<const Recording*> pointers;
  for (const Recording& recording : recordings) pointers.push_back(&recording);
  const std::vector<model::FeatureSpec> features = {{"elbow.estimate"}};
  const std::vector<model::OutputSpec> outputs = {{"elbow", "elbow.estimate", "rad"}};
  const auto rows = make_rows(features, outputs, pointers, 0.01);
  ASSERT_TRUE(rows.ok());
  const HeldOut held_out = held_out_parts(rows->recording, rows->inputs.cast<double>());
  EXPECT_TRUE(held_out.by_recording);
  ASSERT_EQ(held_out.rows.size(), 6U);
  std::vector<int> seen(1000, 0);
  for (std::size_t part = 0; part < 5; ++part) {
    EXPECT_EQ(held_out.rows[part].size(), 200U);
    for (const Eigen::Index row : held_out.rows[part]) ++seen[static_cast<std::size_t>(row)];
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 1000);
  const Eigen::VectorXf values = rows->inputs.col(0);
  const float middle = 0.5F * (values.minCoeff() + values.maxCoeff());
  std::vector<bool> is_outer(1000, false);
  for (const Eigen::Index row : held_out.rows.back())
    is_outer[static_cast<std::size_t>(row)] = true;
  EXPECT_NEAR(static_cast<double>(held_out.rows.back().size()), 500.0, 2.0);
  float nearest_outer = 10.0F;
  float farthest_inner = 0.0F;
  for (Eigen::Index row = 0; row < 1000; ++row) {
    const float distance = std::abs(values[row] - middle);
    if (is_outer[static_cast<std::size_t>(row)]) {
      nearest_outer = std::min(nearest_outer, distance);
    } else {
      farthest_inner = std::max(farthest_inner, distance);
    }
  }
  EXPECT_GE(nearest_outer, farthest_inner);
}

TEST(Assemble, OneNetworkComputesTheSumOfItsParts) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd scaled(800, 4);
  for (double& value : scaled.reshaped()) value = normal(generator);
  std::vector<Part> parts;
  for (const auto& [output, units, columns] :
       std::vector<std::tuple<Eigen::Index, Eigen::Index, std::vector<Eigen::Index>>>{
           {0, 0, {0, 2}}, {0, 20, {1, 2, 3}}, {1, 0, {3}}}) {
    const Basis basis = draw({columns, units, 0.7, 9});
    Eigen::VectorXd readout(basis.size());
    for (double& value : readout) value = 0.1 * normal(generator);
    parts.push_back({output, basis, readout});
  }
  model::CalibrationModel model;
  model.features.resize(4);
  model.outputs.resize(2);
  model.input = {Eigen::VectorXd::Zero(4), Eigen::VectorXd::Ones(4)};
  model.output = {Eigen::Vector2d(0.3, -2.0), Eigen::Vector2d(0.5, 4.0)};
  model.layers = layers_of(parts, scaled, model.output);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(800, 2);
  for (const Part& part : parts) sum.col(part.output) += part.basis.design(scaled) * part.readout;
  EXPECT_LT((model.predict(scaled) - sum).cwiseAbs().maxCoeff(), 1e-4);
  const Eigen::VectorXd spread = (sum.rowwise() - sum.colwise().mean()).colwise().norm() / 28.0;
  EXPECT_GT(spread.minCoeff(), 0.05);
}

}  // namespace
}  // namespace ravencal::choice
