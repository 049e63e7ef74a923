// SPDX-License-Identifier: Apache-2.0
//
// What a reported 95 % interval has to count beyond the scatter between blocks.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/fit/standard_normal.hpp"
#include "diagnose_form.hpp"

namespace {

using namespace ravencal::diagnose;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kRows = 4000;
constexpr double kOffset = 1e-3;
/// Joint angles about a middle far from zero, as a shoulder's are.
constexpr double kMiddle_rad = 1.4, kSwing_rad = 0.4;

Series swinging(Stage stage) {
  Series s;
  s.joint = "one";
  s.stage = stage;
  s.unit = "rad";
  s.t_s = VectorXd::LinSpaced(kRows, 0.0, 0.05 * (kRows - 1));
  s.recording.assign(kRows, 0);
  s.fresh.assign(kRows, 0);
  s.fresh.front() = 1;
  s.held_out.assign(kRows, 0);
  s.valid.assign(kRows, 1);
  s.motion.q = kMiddle_rad + kSwing_rad * (0.9 * s.t_s.array()).sin();
  s.motion.v = 0.9 * kSwing_rad * (0.9 * s.t_s.array()).cos();
  s.motion.a = s.y = VectorXd::Zero(kRows);
  return s;
}

/// A constant and one number of the plant, `stretch` scaled, fitted to `error`.
ChannelFit fit_of(const Series& s, const VectorXd& stretch, const VectorXd& error) {
  ChannelFit fit;
  fit.nominal->prediction = stretch;
  NominalTerm term;
  term.tolerance = 0.1;
  term.column = stretch;
  fit.nominal->terms = {term};
  ChannelModel& model = fit.model;
  model.series = &s;
  model.blocks = make_blocks(s, 20.0);
  model.base = MatrixXd::Ones(kRows, 2);
  model.base.col(1) = stretch;
  model.free_base = model.base;
  model.target = model.free_target = error;
  model.noise = error.array() - error.mean();
  model.correlation_rows = 20.0;
  model.tolerance = {0.1};
  model.limit = {0.1};
  model.held = {0.0};
  const double variance = model.noise.squaredNorm() / kRows;
  model.precision = VectorXd::Zero(2);
  model.precision[1] = variance * model.correlation_rows / 0.01;
  fit.coefficients = joint_fit(model);
  return fit;
}

bool holds(const std::pair<double, double>& interval, double truth) {
  return interval.first <= truth && truth <= interval.second;
}

TEST(DiagnoseInterval, OfAConstantCountsASensorThatWanders) {
  const Series s = swinging(Stage::kTransmission);
  const VectorXd stretch = 1e-9 * s.motion.q;
  std::mt19937_64 engine(4);
  constexpr int kTrials = 100;
  constexpr double kMemory = 0.995;  // 10 s of 200
  int chance = 0, whole = 0;
  double width = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    VectorXd error(kRows);
    double wander = standard_normal(engine);
    for (Index i = 0; i < kRows; ++i) {
      wander = kMemory * wander + std::sqrt(1.0 - kMemory * kMemory) * standard_normal(engine);
      error[i] = kOffset + 5e-5 * wander + 5e-5 * standard_normal(engine);
    }
    const ChannelFit fit = fit_of(s, stretch, error);
    chance += holds(interval_over_time(fit, 0, 1, Doubt::kChance), kOffset) ? 1 : 0;
    const auto ci = interval_over_time(fit, 0, 1, Doubt::kFormToo);
    whole += holds(ci, kOffset) ? 1 : 0;
    width += (ci.second - ci.first) / kTrials;
  }
  // The mean of so few independent values scatters by 1.6e-5; blocks of 3 s know half of it.
  EXPECT_LT(chance, 85);
  EXPECT_GE(whole, 88);
  EXPECT_LE(whole, 99);
  EXPECT_LT(width, 2.0 * 2.78 * 1.6e-5) << "Student's quantile of four";
}

TEST(DiagnoseInterval, OfAConstantCountsACableThatStiffens) {
  const Series s = swinging(Stage::kTransmission);
  // A load that swings about a mean stretches a cable by 4 to 8 mrad.
  const VectorXd stretch = 6e-3 + 2e-3 * (1.3 * s.t_s.array()).sin();
  std::mt19937_64 engine(5);
  VectorXd error(kRows);
  for (Index i = 0; i < kRows; ++i)
    error[i] = kOffset - 0.015 * std::pow(stretch[i], 3) / 36e-6 + 2e-4 * standard_normal(engine);
  const ChannelFit fit = fit_of(s, stretch, error);
  EXPECT_FALSE(holds(interval_over_time(fit, 0, 1, Doubt::kChance), kOffset));
  const auto ci = interval_over_time(fit, 0, 1, Doubt::kFormToo);
  EXPECT_TRUE(holds(ci, kOffset)) << ci.first << " " << ci.second;
  EXPECT_LT(ci.second - ci.first, kOffset);
}

TEST(DiagnoseInterval, OfAStepIsWhatAllRowsBeforeAndAfterSay) {
  const Series s = swinging(Stage::kTransmission);
  const VectorXd stretch = 1e-9 * s.motion.q;
  VectorXd step = VectorXd::Zero(kRows);
  step.tail(kRows / 2).setOnes();
  std::mt19937_64 engine(7);
  constexpr int kTrials = 60;
  int held = 0;
  double width = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    VectorXd error = kOffset * step;
    for (Index i = 0; i < kRows; ++i) error[i] += 2e-4 * standard_normal(engine);
    ChannelFit fit = fit_of(s, stretch, error);
    ChannelModel& model = fit.model;
    model.base.conservativeResize(Eigen::NoChange, 3);
    model.base.col(2) = step;
    model.free_base = model.base;
    model.precision.conservativeResize(3);
    model.precision[2] = 0.0;
    fit.coefficients = joint_fit(model);
    const auto ci = interval_over_time(fit, 2, 1, Doubt::kFormToo);
    held += holds(ci, kOffset) ? 1 : 0;
    width += (ci.second - ci.first) / kTrials;
  }
  EXPECT_GE(held, 52);
  // Two halves of 2000 rows differ by 6.3e-6; Student's quantile of few cosines is twice a
  // normal's.
  EXPECT_LT(width, 2.0 * 2.0 * 1.96 * 6.3e-6);
}

TEST(DiagnoseInterval, OfAConstantIsNoWiderWhereNothingWandersNorStretches) {
  const Series s = swinging(Stage::kDrive);
  const VectorXd stretch = s.motion.v;
  std::mt19937_64 engine(6);
  double chance = 0.0, whole = 0.0;
  for (int trial = 0; trial < 40; ++trial) {
    VectorXd error(kRows);
    for (Index i = 0; i < kRows; ++i) error[i] = kOffset + 2e-4 * standard_normal(engine);
    const ChannelFit fit = fit_of(s, stretch, error);
    const auto narrow = interval_over_time(fit, 0, 1, Doubt::kChance);
    const auto wide = interval_over_time(fit, 0, 1, Doubt::kFormToo);
    chance += narrow.second - narrow.first;
    whole += wide.second - wide.first;
  }
  EXPECT_LT(whole, 1.4 * chance) << "Student's price for so few slow cosines";
}

/// A number of the plant that is 5 % more than the plant says, and an error of its form that asks
/// for 20 % less: it ends at its limit, and what it should have said of the ratio is the ratio's.
TEST(DiagnoseInterval, CountsNumbersThatTheDataHoldAtTheirLimits) {
  constexpr double kRatio = 0.004;
  const Series s = swinging(Stage::kTransmission);
  const VectorXd own = 1e-3 * (1.3 * s.t_s.array()).sin();
  const VectorXd stretch = 2e-3 * s.motion.q + own;
  std::mt19937_64 engine(8);
  VectorXd noise(kRows);
  for (double& x : noise) x = 2e-5 * standard_normal(engine);
  ChannelFit fit = fit_of(s, stretch, kRatio * s.motion.q + 0.05 * stretch - 0.25 * own + noise);
  ChannelModel& model = fit.model;
  model.precision[1] *= noise.squaredNorm() / model.noise.squaredNorm();
  model.noise = noise;
  fit.forms.push_back(ravencal::generator::form_of("gain_error"));
  auto candidate = std::make_shared<FormCandidate>();
  candidate->form = fit.forms.front().get();
  model.candidates.push_back(candidate);
  model.chosen.push_back({0, {}, model.blocks.gather(s.motion.q)});
  model.hold_nominal();
  fit.coefficients = joint_fit(model);
  ASSERT_EQ(model.held.front(), -0.1);
  auto parameters = parameters_of(fit, 0, 1, Doubt::kFormToo);
  ASSERT_FALSE(holds(parameters.front().ci95, kRatio));
  widen_by_held(fit, 0, parameters);
  const Interval ci = parameters.front().ci95;
  EXPECT_TRUE(holds(ci, kRatio)) << ci.first << " " << ci.second;
  EXPECT_LT(ci.second - ci.first, 6e-4) << "one side, by a tolerance of 2e-4 and its 95 %";
}

TEST(DiagnoseInterval, OfAWaveDoesNotHangOnWhereTheJointsZeroIs) {
  const Series s = swinging(Stage::kDrive);
  const auto ripple = ravencal::generator::form_of("torque_ripple");
  constexpr double kOrder = 20.0, kLittle = 1e-4;
  const MatrixXd wave = ripple->columns(s, {kOrder});
  const VectorXd moved = (ripple->columns(s, {kOrder + kLittle}) - wave).col(0) / kLittle;
  // A little more order turns no phase that the cosine would have to make good.
  EXPECT_LT(std::abs(moved.dot(wave.col(1))), 0.2 * moved.norm() * wave.col(1).norm());
  VectorXd b(2);
  b << 0.3, -0.4;
  const auto parameters = ripple->parameters(s, {kOrder}, b);
  const VectorXd again =
      parameters[0].value *
      (parameters[1].value * s.motion.q.array() + parameters[2].value).sin().matrix();
  EXPECT_LT((again - wave * b).norm(), 1e-9 * again.norm()) << "the phase is about zero";
}

}  // namespace
