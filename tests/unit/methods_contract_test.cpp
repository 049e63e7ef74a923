// SPDX-License-Identifier: Apache-2.0
//
// What every method promises, whatever it models.
#include <gtest/gtest.h>

#include <cmath>

#include "methods/blocked.hpp"
#include "unit/methods_sample.hpp"

namespace ravencal::test {
namespace {

using methods::Series;

class EveryMethod : public ::testing::TestWithParam<std::string> {
 protected:
  static methods::Settings settings() {
    methods::Settings s = quick_settings();
    s.epochs = 5;
    s.lstm_iterations = 40;
    s.gru_units = 4;
    s.gru_iterations = 20;
    s.trees = 5;
    s.physics = sample_diagnosis("methods_contract", 0.2);
    return s;
  }
  static methods::Problem problem() {
    methods::Problem p = sample_problem();
    p.features.push_back(model::FeatureSpec::parse("elbow.estimate~0.1").value());
    return p;
  }
  static Series series(Eigen::Index rows, std::uint64_t seed) {
    Series s = sample_series(rows, seed, linear_error);
    s.inputs.conservativeResize(Eigen::NoChange, 5);
    double play = s.inputs(0, 0);
    for (Eigen::Index i = 0; i < rows; ++i) {
      play = std::clamp(play, s.inputs(i, 0) - 0.1, s.inputs(i, 0) + 0.1);
      s.inputs(i, 4) = play;
    }
    return s;
  }
  static std::unique_ptr<methods::Predictor> fitted() {
    const std::vector<Series> train = {series(400, 1), series(250, 3)};
    auto predictor = method(GetParam()).fit(problem(), train, settings());
    EXPECT_TRUE(predictor.ok()) << (predictor.ok() ? "" : predictor.error().message);
    return std::move(predictor).value();
  }
};

TEST_P(EveryMethod, PredictsRowByRowWhatItPredictsAtOnce) {
  const auto predictor = fitted();
  Series test = series(300, 2);
  test.fresh[150] = 1;
  test.inputs(40, 1) = std::nan("");
  const Eigen::MatrixXd at_once = predictor->predict(test);
  const Eigen::MatrixXd by_row = predictor->methods::Predictor::predict(test);
  for (Eigen::Index row = 0; row < test.rows(); ++row) {
    if (row == 40) {
      EXPECT_FALSE(at_once.row(row).allFinite());
      EXPECT_FALSE(by_row.row(row).allFinite());
    } else {
      EXPECT_LT((at_once.row(row) - by_row.row(row)).cwiseAbs().maxCoeff(), 1e-5) << row;
    }
  }
}

TEST_P(EveryMethod, SeesNoTruthWhenItPredicts) {
  const auto predictor = fitted();
  Series test = series(200, 2);
  const Eigen::MatrixXd before = predictor->predict(test);
  test.errors.setConstant(std::nan(""));
  EXPECT_EQ((before - predictor->predict(test)).cwiseAbs().maxCoeff(), 0.0);
}

TEST_P(EveryMethod, GivesTheSameForTheSameSeed) {
  const Series test = series(200, 2);
  EXPECT_EQ((fitted()->predict(test) - fitted()->predict(test)).cwiseAbs().maxCoeff(), 0.0);
}

TEST_P(EveryMethod, StopsWhenAskedOrIsDoneAtOnce) {
  methods::Settings s = settings();
  s.keep_going = [](double) { return false; };
  const std::vector<Series> train = {series(400, 1)};
  const auto predictor = method(GetParam()).fit(problem(), train, s);
  if (!predictor.ok()) {
    EXPECT_EQ(predictor.error().message, methods::stopped().message);
  }
}

TEST_P(EveryMethod, RefusesRowsWithoutTruthInsteadOfInventing) {
  if (GetParam() == "raw") GTEST_SKIP() << "raw needs no truth";
  std::vector<Series> train = {series(300, 1)};
  train[0].errors.setConstant(std::nan(""));
  const auto predictor = method(GetParam()).fit(problem(), train, settings());
  if (!predictor.ok()) return;
  // Those that fit joint by joint may find nothing to fit: then they must correct nothing.
  const Eigen::MatrixXd correction = (*predictor)->predict(series(50, 2));
  EXPECT_LT(correction.cwiseAbs().maxCoeff(), 1e-9) << GetParam();
}

std::vector<std::string> ids() {
  std::vector<std::string> all;
  for (const auto& m : methods::all_methods()) all.emplace_back(m->id());
  return all;
}
INSTANTIATE_TEST_SUITE_P(Methods, EveryMethod, ::testing::ValuesIn(ids()),
                         [](const auto& tested) { return tested.param; });

TEST(Methods, TheGaussianProcessStopsWithinAJoint) {
  int asked = 0;
  methods::Settings s;
  s.keep_going = [&](double) { return ++asked < 5; };
  const std::vector<Series> train = {sample_series(3000, 1, linear_error)};
  const auto predictor = method("gp").fit(sample_problem(), train, s);
  ASSERT_FALSE(predictor.ok());
  EXPECT_EQ(predictor.error().message, methods::stopped().message);
}

TEST(Methods, ThatNeedTimeSayThatPosesHaveNone) {
  methods::Problem problem = sample_problem();
  problem.order = methods::Order::kPoses;
  for (const char* id : {"gru", "lstm", "ukf", "bouc_wen", "physics", "physics_network"})
    EXPECT_FALSE(method(id).unsuited(problem, {}, quick_settings()).empty()) << id;
  for (const char* id : {"linear", "ridge", "polynomial", "gp", "network", "two_phase"})
    EXPECT_TRUE(method(id).unsuited(problem, {}, quick_settings()).empty()) << id;
}

TEST(Methods, OfDynamicsSayThatPosesFarApartHaveNone) {
  methods::Problem problem = sample_problem();
  problem.order = methods::Order::kSequence;
  problem.row_period_s = 1.5;
  EXPECT_NE(method("ukf").unsuited(problem, {}, quick_settings()).find("1.5 s"), std::string::npos);
  EXPECT_TRUE(method("bouc_wen").unsuited(problem, {}, quick_settings()).empty());
}

TEST(Blocked, FoldsHoldEveryRowThatTrainsOnce) {
  std::vector<Series> all = {sample_series(100, 1, linear_error),
                             sample_series(37, 2, linear_error)};
  all[0].errors.topRows(60).setConstant(std::nan(""));  // rows that do not train
  Eigen::Index held_out = 0;
  for (int f = 0; f < methods::kFolds; ++f) {
    const methods::Fold fold = methods::make_fold(all, f);
    const Eigen::Index part = methods::count_training_rows(fold.held_out);
    EXPECT_EQ(part + methods::count_training_rows(fold.train), 77);
    EXPECT_GE(part, 19);
    held_out += part;
  }
  EXPECT_EQ(held_out, 77);
}

TEST(Blocked, FirstRowsCountRowsThatTrain) {
  std::vector<Series> all = {sample_series(100, 1, linear_error),
                             sample_series(40, 2, linear_error)};
  all[0].errors.topRows(90).setConstant(std::nan(""));
  const auto first = methods::first_rows(all, 25);
  EXPECT_EQ(methods::count_training_rows(first), 25);
  EXPECT_EQ(methods::count_rows(first), 115);
  EXPECT_TRUE(methods::first_rows(all, 0).empty());
}

}  // namespace
}  // namespace ravencal::test
