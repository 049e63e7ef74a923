// SPDX-License-Identifier: Apache-2.0
//
// A constant effort of the drive that differs between recordings.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "diagnose/diagnose.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose_form.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;

/// Joint "one" with dry friction, recorded once per constant effort.
diagnose::Report recorded_with(const std::vector<double>& offsets_n_m) {
  std::vector<record::Recording> recordings;
  for (const double offset : offsets_n_m) {
    recordings.push_back(generator::make_recording(
        {.coulomb_n_m = 0.5},
        {.seed = 7 + recordings.size(), .duration_s = 200.0, .with_truth = false}));
    recordings.back().samples.col(2).array() += offset;
  }
  const auto plant = physics::parse_plant(
      generator::plant_text(
          "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 0.5\n"),
      "test plant");
  EXPECT_TRUE(plant.ok());
  diagnose::Options options;
  options.threads = 1;
  auto report = diagnose::diagnose(recordings, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

/// What the report says where it does not find the effect in joint "one".
diagnose::NotFound silence_of(const diagnose::Report& report) {
  for (const diagnose::NotFound& entry : report.not_found)
    if (entry.id == "effort_offset" && entry.joint == "one") return entry;
  ADD_FAILURE() << report.verdict.text;
  return {};
}

TEST(EffortOffset, IsNamedWhereTwoRecordingsDifferByAConstant) {
  const diagnose::Report report = recorded_with({0.3, -0.1});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  const diagnose::NamedEffect& effect = report.effects.front();
  EXPECT_EQ(effect.id, "effort_offset");
  EXPECT_EQ(effect.stage, "drive");
  ASSERT_EQ(effect.parameters.size(), 2U);
  const double truth[] = {0.2, -0.2};
  for (std::size_t p = 0; p < 2; ++p) {
    const diagnose::NamedParameter& offset = effect.parameters[p];
    EXPECT_EQ(offset.name, "offset_recording_" + std::to_string(p + 1));
    EXPECT_EQ(offset.unit, "N_m");
    EXPECT_LE(offset.ci95.first, truth[p]);
    EXPECT_GE(offset.ci95.second, truth[p]);
    EXPECT_NEAR(offset.value, truth[p], 0.05);
  }
}

TEST(EffortOffset, IsNoFindingWhereTheRecordingsShareTheirConstant) {
  const diagnose::Report report = recorded_with({0.1, 0.1});
  EXPECT_TRUE(report.effects.empty()) << report.verdict.text;
  const diagnose::NotFound silent = silence_of(report);
  ASSERT_TRUE(silent.detection_limit.has_value()) << silent.not_testable_because;
  EXPECT_LT(*silent.detection_limit, 0.2);
}

TEST(EffortOffset, CannotBeToldFromFrictionInASingleRecording) {
  const diagnose::NotFound silent = silence_of(recorded_with({0.3}));
  EXPECT_NE(silent.not_testable_because.find("friction"), std::string::npos);
}

/// Two rows of each recording; the last one is held out.
diagnose::Series series_of_recordings(int count) {
  diagnose::Series s;
  s.stage = diagnose::Stage::kDrive;
  for (int i = 0; i < 2 * count; ++i) s.recording.push_back(i / 2);
  s.y = Eigen::VectorXd::Zero(2 * count);
  s.held_out.assign(s.recording.size(), 0);
  s.held_out.end()[-1] = s.held_out.end()[-2] = 1;
  s.valid.assign(s.recording.size(), 1);
  return s;
}

TEST(EffortOffset, ItsValuesSumToZeroAndSayNothingOfAHeldOutRecording) {
  const diagnose::Series s = series_of_recordings(4);
  const auto form = generator::form_of("effort_offset");
  const Eigen::MatrixXd columns = form->columns(s, {});
  ASSERT_EQ(columns.cols(), 2);
  EXPECT_EQ(columns.bottomRows(2).cwiseAbs().maxCoeff(), 0.0);
  const Eigen::Vector2d b(0.3, -0.1);
  const auto offsets = form->parameters(s, {}, b);
  ASSERT_EQ(offsets.size(), 3U);
  EXPECT_EQ(form->sizes(s), 3U);
  const Eigen::VectorXd effort = columns * b;
  double sum = 0.0;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    sum += offsets[k].value;
    EXPECT_NEAR(offsets[k].value, effort[static_cast<Eigen::Index>(2 * k)], 1e-12);
  }
  EXPECT_NEAR(sum, 0.0, 1e-12);
  EXPECT_NE(form->untestable(s), "") << "no recording tells another's constant";
  EXPECT_EQ(form->untestable(series_of_recordings(3)), "");
}

TEST(EffortOffset, OfThePlantIsInItsPredictionWhateverTheTorqueConstant) {
  const auto plant = physics::parse_plant(
      generator::plant_text("\n  [[joint.effect]]\n  id = \"effort_offset\"\n  offset_n_m = 0.4\n"
                            "\n  [[joint.effect]]\n  id = \"torque_constant\"\n  ratio = 0.25\n"),
      "test plant");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  diagnose::Series s = series_of_recordings(3);
  s.joint = "one";
  s.motion.q = s.motion.v = s.motion.a = s.t_s = Eigen::VectorXd::Zero(s.rows());
  s.fresh.assign(s.recording.size(), 0);
  const diagnose::Nominal nominal = diagnose::nominal_of(s, plant.value());
  EXPECT_NEAR(nominal.prediction.minCoeff(), 0.4, 1e-12);
  EXPECT_NEAR(nominal.prediction.maxCoeff(), 0.4, 1e-12);
  const auto own = [](const diagnose::NominalTerm& t) { return t.id == "effort_offset"; };
  EXPECT_TRUE(std::any_of(nominal.terms.begin(), nominal.terms.end(), own));
}

TEST(Causes, AMotorThatGivesThreeFifthsIsATorqueConstantWithThatRatio) {
  const auto form = generator::form_of("torque_constant");
  // Recorded effort is the needed one over 0.6: 1.667 times it, a coefficient of -0.667.
  const Eigen::VectorXd b = Eigen::VectorXd::Constant(1, -2.0 / 3.0);
  EXPECT_NEAR(form->parameters({}, {}, b).front().value, -0.4, 1e-12);
  EXPECT_TRUE(form->inconsistency({}, {}, b).empty());
  // No plant states it, so that it has no limits to stay within: where the plant's own numbers can
  // say as much within theirs, nothing is left for it.
  EXPECT_TRUE(form->inconsistency({}, {}, Eigen::VectorXd::Constant(1, 0.1)).empty());
  EXPECT_FALSE(form->inconsistency({}, {}, Eigen::VectorXd::Constant(1, 0.6)).empty());
}

}  // namespace
