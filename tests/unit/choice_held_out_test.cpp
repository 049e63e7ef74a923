// SPDX-License-Identifier: Apache-2.0
//
// `train` without a method: what is held out, what has a constant of its own, what is expected of
// other recordings, and what is said of a joint that was held.
#include <map>

#include "choice/expected.hpp"
#include "choice/held_out.hpp"
#include "choice/rows.hpp"
#include "choice/variety.hpp"
#include "choice_sample.hpp"

namespace ravencal::choice {
namespace {

/// What is fast to try and has a memory.
const ChoiceOptions kLines = [] {
  ChoiceOptions options;
  options.kinds = Kinds::kLinear;
  return options;
}();

std::string joined(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += sentence + "\n";
  return text;
}

/// With a wrist that moves by at most `travel` and errs by 0.02 and 30 times its motion.
Recording with_wrist(Recording arm, double travel) {
  for (const char* channel : {"estimate", "truth", "torque"}) {
    record::Channel held = arm.channels[*arm.column("elbow." + std::string(channel))];
    held.name = "wrist." + std::string(channel);
    held.joint = "wrist";
    arm.channels.push_back(held);
  }
  arm.samples.conservativeResize(Eigen::NoChange, 9);
  for (Eigen::Index row = 0; row < arm.rows(); ++row) {
    const double moved = travel * std::sin(0.013 * static_cast<double>(row));
    arm.samples.row(row).tail(3) << 0.3 + 0.5 * moved, 0.32 + 15.0 * moved, arm.samples(row, 2);
  }
  return arm;
}

/// Adds to the truth of the elbow.
Recording shifted(Recording arm, double constant_rad) {
  arm.samples.col(1).array() += constant_rad;
  return arm;
}

TEST(HeldJoint, IsCorrectedByItsMeanAndIsNoInput) {
  for (const double travel_rad : {0.0, 0.004}) {
    const Recording arm = with_wrist(elbow(3000, 1, kPlay), travel_rad);
    const auto choice = choose({arm});
    ASSERT_TRUE(choice.ok()) << choice.error().message;
    ASSERT_EQ(choice->joints.size(), 2U);
    EXPECT_EQ(choice->joints[1].tried.size(), 1U) << "bias alone";
    EXPECT_NE(joined(choice->warnings).find("joint wrist hardly moves"), std::string::npos);
    for (const model::FeatureSpec& feature : choice->model.features)
      EXPECT_EQ(feature.text().find("wrist"), std::string::npos) << feature.text();
    // What the wrist does elsewhere changes nothing: its bias, and an elbow that does not see it.
    const Recording test = with_wrist(elbow(3000, 2, kPlay), 0.6);
    const Recording* const recordings[] = {&test};
    const auto evaluation = learn::evaluate(choice->model, recordings);
    ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
    EXPECT_LT(evaluation->joints[0].calibrated.rmse, 0.004);
    EXPECT_NEAR(evaluation->joints[1].calibrated.rmse, evaluation->joints[1].bias_removed.rmse,
                1e-6);
  }
}

TEST(HeldOut, PartsHoldEveryRowOnceAndTheOutermostHalfIsBeyond) {
  std::vector<Recording> recordings;
  for (unsigned seed = 1; seed <= 5; ++seed) recordings.push_back(elbow(200, seed, kLinear));
  std::vector<const Recording*> pointers;
  for (const Recording& recording : recordings) pointers.push_back(&recording);
  const std::vector<model::FeatureSpec> features = {{"elbow.estimate"}};
  const std::vector<model::OutputSpec> outputs = {{"elbow", "elbow.estimate", "rad"}};
  const auto rows = make_rows(features, outputs, pointers, 0.01);
  ASSERT_TRUE(rows.ok());
  const HeldOut held_out = held_out_parts(rows->recording, {rows->inputs.cast<double>(), {}, {}});
  EXPECT_TRUE(held_out.by_recording);
  EXPECT_EQ(held_out.parts, 5U);
  ASSERT_EQ(held_out.lists.size(), 6U);
  std::vector<int> seen(1000, 0);
  for (std::size_t part = 0; part < 5; ++part) {
    EXPECT_EQ(held_out.lists[part].size(), 200U);
    for (const Eigen::Index row : held_out.lists[part]) ++seen[static_cast<std::size_t>(row)];
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 1000);
  const Eigen::VectorXf values = rows->inputs.col(0);
  const float middle = 0.5F * (values.minCoeff() + values.maxCoeff());
  std::vector<bool> is_outer(1000, false);
  for (const Eigen::Index row : held_out.lists.back())
    is_outer[static_cast<std::size_t>(row)] = true;
  EXPECT_NEAR(static_cast<double>(held_out.lists.back().size()), 500.0, 2.0);
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

TEST(HeldOut, TwoRecordingsAreHeldOutWhole) {
  const std::vector<int> recording = {0, 0, 0, 1, 1};
  const HeldOut held_out = held_out_parts(recording, {Eigen::MatrixXd(5, 0), {}, {}});
  EXPECT_TRUE(held_out.by_recording);
  const std::vector<std::vector<Eigen::Index>> whole = {{0, 1, 2}, {3, 4}};
  EXPECT_EQ(held_out.lists, whole);
}

TEST(HeldOut, TheFasterHalfIsBeyondWhereTheSpeedVaries) {
  const std::vector<int> recording(100, 0);
  Eigen::MatrixXd speeds(100, 1);
  for (Eigen::Index row = 0; row < 100; ++row) speeds(row, 0) = row % 2 == 0 ? 0.1 : 0.3;
  const Motion faster{Eigen::MatrixXd(100, 0), speeds, {}};
  const HeldOut held_out = held_out_parts(recording, faster);
  EXPECT_EQ(held_out.parts, 5U);
  // Ties at the median belong to neither half.
  speeds.array() += 0.001 * Eigen::ArrayXd::LinSpaced(100, 0.0, 1.0);
  const HeldOut sorted = held_out_parts(recording, {Eigen::MatrixXd(100, 0), speeds, {}});
  ASSERT_EQ(sorted.lists.size(), 6U);
  for (const Eigen::Index row : sorted.lists.back()) EXPECT_EQ(row % 2, 1);
  const HeldOut steady = held_out_parts(
      recording, {Eigen::MatrixXd(100, 0), Eigen::MatrixXd::Constant(100, 1, 0.2), {}});
  EXPECT_EQ(steady.lists.size(), 5U);
}

TEST(Sessions, RecordingsThatDifferByAConstantHaveOneEach) {
  std::vector<Recording> days;
  for (unsigned seed = 1; seed <= 4; ++seed)
    days.push_back(shifted(elbow(3000, seed, kPlay), seed % 2 == 0 ? 0.08 : -0.02));
  const auto own = choose(days, kLines);
  ChoiceOptions one = kLines;
  one.sessions = SessionRule::kNone;
  const auto shared = choose(days, one);
  ASSERT_TRUE(own.ok() && shared.ok());
  EXPECT_EQ(own->joints[0].session_constants.size(), 4U);
  EXPECT_EQ(shared->joints[0].session_constants.size(), 1U);
  const Recording test = elbow(3000, 9, kPlay);
  const Recording* const recordings[] = {&test};
  const auto of_own = learn::evaluate(own->model, recordings);
  const auto of_shared = learn::evaluate(shared->model, recordings);
  ASSERT_TRUE(of_own.ok() && of_shared.ok());
  EXPECT_LT(of_own->joints[0].rmse_about_mean, 0.7 * of_shared->joints[0].rmse_about_mean);
}

TEST(Sessions, RecordingsOfOneConstantShareIt) {
  const auto choice =
      choose({elbow(3000, 1, kPlay), elbow(3000, 2, kPlay), elbow(3000, 3, kPlay)}, kLines);
  ASSERT_TRUE(choice.ok());
  EXPECT_EQ(choice->joints[0].session_constants.size(), 1U);
}

TEST(Sessions, ARehomingBeginsOne) {
  for (const char* kind : {"homing", "rehoming"}) {
    Recording arm = elbow(6000, 1, kPlay);
    arm.samples.col(1).tail(3000).array() += 0.1;
    arm.events = {{arm.t_ns[3000], kind, ""}};
    const auto choice = choose({arm}, kLines);
    ASSERT_TRUE(choice.ok());
    ASSERT_EQ(choice->joints[0].session_constants.size(), 2U);
    EXPECT_NEAR(choice->joints[0].session_constants[1] - choice->joints[0].session_constants[0],
                0.1, 0.01);
  }
}

TEST(Homings, AreToldByTheirConstantsNotByTheirFiles) {
  const auto homed = [](unsigned seed, double constant) {
    Recording arm = shifted(elbow(3000, seed, kPlay), constant);
    arm.events = {{arm.t_ns.front(), "homing", ""}};
    return arm;
  };
  const auto one = choose({homed(1, 0.0), homed(2, 0.0), homed(3, 0.0)}, kLines);
  ASSERT_TRUE(one.ok());
  EXPECT_EQ(one->joints[0].session_constants.size(), 3U);
  EXPECT_EQ(one->joints[0].homing_constants.size(), 1U);
  EXPECT_FALSE(one->model.expected[0].other_homing.has_value());
  EXPECT_NE(joined(one->warnings).find("one homing"), std::string::npos) << joined(one->warnings);

  const auto two = choose({homed(1, 0.0), homed(2, 0.08), homed(3, 0.0), homed(4, 0.08)}, kLines);
  ASSERT_TRUE(two.ok());
  EXPECT_EQ(two->joints[0].homing_constants.size(), 2U);
  ASSERT_TRUE(two->model.expected[0].other_homing.has_value());
  EXPECT_GT(two->model.expected[0].other_homing->rmse, 0.05);
  EXPECT_LT(two->model.expected[0].same_homing.rmse, 0.02);
  EXPECT_EQ(joined(two->warnings).find("one homing"), std::string::npos);
}

TEST(ExpectedError, HoldsTheErrorOfOtherRecordings) {
  const auto choice =
      choose({elbow(4000, 1, kCurve), elbow(4000, 2, kCurve), elbow(4000, 3, kCurve)});
  ASSERT_TRUE(choice.ok());
  ASSERT_EQ(choice->model.expected.size(), 1U);
  const model::ExpectedError& expected = choice->model.expected[0];
  EXPECT_LT(expected.any().low, expected.any().rmse);
  EXPECT_LT(expected.any().rmse, expected.any().high);
  int inside = 0;
  for (unsigned seed = 11; seed <= 20; ++seed) {
    const double came = rmse_on(choice->model, elbow(3000, seed, kCurve));
    inside += expected.any().low <= came && came <= expected.any().high;
  }
  EXPECT_GE(inside, 8);
}

TEST(ExpectedError, GrowsWithTheSpreadOfTheConstants) {
  const std::vector<Eigen::VectorXd> judged(6, Eigen::VectorXd::LinSpaced(100, -0.01, 0.01));
  const model::ExpectedError still = expected_error(judged, {0.02});
  const model::ExpectedError jumps = expected_error(judged, {0.02, 0.05, -0.01});
  ASSERT_TRUE(jumps.other_homing.has_value());
  EXPECT_GT(jumps.other_homing->rmse, 0.03);
  EXPECT_GT(jumps.other_homing->high, 0.12);
  EXPECT_FALSE(still.other_homing.has_value());
  EXPECT_NEAR(still.same_homing.rmse, 0.00583, 1e-4);
  EXPECT_DOUBLE_EQ(jumps.same_homing.high, still.same_homing.high);
  EXPECT_DOUBLE_EQ(jumps.about_mean, still.about_mean);
}

TEST(ExpectedError, IsFiniteWhereSomeRowsAreExact) {
  const std::vector<Eigen::VectorXd> judged = {Eigen::VectorXd::Zero(100),
                                               Eigen::VectorXd::LinSpaced(100, -0.01, 0.01)};
  const model::ExpectedError expected = expected_error(judged, {0.02});
  EXPECT_TRUE(std::isfinite(expected.same_homing.high));
  EXPECT_GT(expected.same_homing.high, expected.same_homing.rmse);
}

TEST(Variety, OneOfAKindIsSaid) {
  const auto said = [](const std::vector<Recording>& recordings) {
    const auto choice = choose(recordings, kLines);
    EXPECT_TRUE(choice.ok());
    return joined(choice->warnings);
  };
  Recording arm = elbow(2000, 1, kLinear);
  EXPECT_NE(said({arm}).find("one homing and one load"), std::string::npos) << said({arm});
  EXPECT_NE(said({arm, arm}).find("one homing and one load"), std::string::npos);
  arm.events = {{arm.t_ns.front(), "homing", ""}};
  const Recording other = shifted(arm, 0.08);
  EXPECT_NE(said({arm, other}).find("the training has one load:"), std::string::npos);
  for (const Eigen::Index effort_or_sensor : {2, 3}) {
    Recording loaded = other;
    loaded.samples.col(effort_or_sensor) *= 2.0;
    EXPECT_EQ(said({arm, loaded}), "") << effort_or_sensor;
  }
}

}  // namespace
}  // namespace ravencal::choice
