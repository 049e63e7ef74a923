// SPDX-License-Identifier: Apache-2.0
//
// The three traps of the prototype (permutation scheme, contaminated null, recorded effort as its
// own explanation) and the pieces that keep clear of them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/fit/blocks.hpp"
#include "diagnose/fit/sign_flip.hpp"
#include "diagnose/selection/contenders.hpp"
#include "diagnose/selection/search.hpp"
#include "diagnose/series/operators.hpp"
#include "diagnose_form.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using diagnose::FlipCandidate;
using diagnose::FlipOption;
using Eigen::Index;
using Eigen::VectorXd;
using generator::Given;
using generator::noise;

/// A candidate whose column is `column`, for noise `residual` in blocks of `length`.
FlipCandidate candidate_of(const VectorXd& column, const VectorXd& residual, Index length,
                           double gain) {
  FlipOption option;
  option.scores.resize(column.size() / length, 1);
  for (Index b = 0; b < option.scores.rows(); ++b) {
    option.scores(b, 0) =
        column.segment(b * length, length).dot(residual.segment(b * length, length));
  }
  option.inverse = Eigen::MatrixXd::Constant(1, 1, 1.0 / column.squaredNorm());
  return {{option}, gain, 0};
}

TEST(SignFlip, GoesThroughAllPatternsOfAFewValues) {
  const VectorXd three = (VectorXd(3) << 3.0, 2.0, 1.0).finished();
  EXPECT_DOUBLE_EQ(diagnose::exact_sign_flip_p(three), 0.25);
  const VectorXd mixed = (VectorXd(3) << 3.0, 2.0, -1.0).finished();
  EXPECT_DOUBLE_EQ(diagnose::exact_sign_flip_p(mixed), 0.5);
  EXPECT_EQ(diagnose::exact_sign_flip_p(VectorXd::Zero(5)), 1.0);
  EXPECT_DOUBLE_EQ(diagnose::exact_sign_flip_p(VectorXd::Ones(24)), diagnose::least_exact_p(24));
  const VectorXd drawn = noise(20, 9).array() + 0.2;
  EXPECT_NEAR(diagnose::exact_sign_flip_p(drawn), diagnose::sign_flip_p(drawn, 1, 200000), 3e-3);
}

TEST(SignFlip, PutsNeighboursTogetherWhereThePatternsAreTooMany) {
  const double least = diagnose::least_exact_p(diagnose::kMostExactFlips);
  for (const Index many : {33, 64, 1000, 100'000}) {
    EXPECT_DOUBLE_EQ(diagnose::exact_sign_flip_p(VectorXd::Ones(many)), least) << many;
    EXPECT_EQ(diagnose::exact_sign_flip_p(VectorXd::Zero(many)), 1.0) << many;
  }
  VectorXd pairs(64);
  for (Index i = 0; i < 64; ++i) pairs[i] = i < 6 ? 1.0 : 0.0;
  EXPECT_DOUBLE_EQ(diagnose::exact_sign_flip_p(pairs), 0.25) << "three sums of two";
}

TEST(SignFlip, CanTestAConstantAndAStep) {
  // Circular shifts leave a constant as it is and a step nearly so: p would be 1 for both.
  const Index rows = 2000;
  const VectorXd residual = noise(rows, 3);
  const VectorXd constant = VectorXd::Ones(rows);
  VectorXd step = VectorXd::Zero(rows);
  step.tail(rows / 2).setOnes();
  for (const VectorXd& column : {constant, step}) {
    const VectorXd y = 0.3 * column + residual;
    const double gain = std::pow(column.dot(y), 2) / column.squaredNorm();
    const auto result =
        diagnose::sign_flip_test({candidate_of(column, residual, 50, gain)}, 0.01, 5);
    EXPECT_LT(result.p_value.front(), 0.005);
  }
}

TEST(SignFlip, GivesNoiseItsShareOfAlarmsAndNoMore) {
  const Index rows = 1600;
  int alarms = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    const VectorXd residual = noise(rows, 100 + static_cast<std::uint64_t>(trial));
    std::vector<FlipCandidate> candidates;
    for (std::uint64_t c = 0; c < 5; ++c) {
      const VectorXd column = noise(rows, 10000 + 5 * static_cast<std::uint64_t>(trial) + c);
      candidates.push_back(candidate_of(column, residual, 40,
                                        std::pow(column.dot(residual), 2) / column.squaredNorm()));
    }
    const auto result = diagnose::sign_flip_test(candidates, 0.05, 9, 499);
    bool any = false;
    for (const double p : result.p_value) any = any || p <= 0.05;
    alarms += any ? 1 : 0;
  }
  // 15 expected of 300 at 5 %; beyond 28 is one in a thousand.
  EXPECT_LE(alarms, 28);
  EXPECT_GE(alarms, 4);
}

TEST(SignFlip, LetsFewAndManyColumnsBeFoundAlike) {
  // Counted in multiples of their median, gains of one column would take nine in ten of chance's
  // alarms from gains of three (quantiles of chi-squared).
  const Index rows = 1600;
  constexpr int kTrials = 400;
  int first = 0, second = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto seed = static_cast<std::uint64_t>(trial);
    const VectorXd residual = noise(rows, 500 + seed);
    const VectorXd alone = noise(rows, 20000 + seed);
    const double gain = std::pow(alone.dot(residual), 2) / alone.squaredNorm();
    FlipCandidate many;
    FlipOption option;
    option.inverse = Eigen::MatrixXd::Zero(3, 3);
    option.scores.resize(rows / 40, 3);
    for (Index c = 0; c < 3; ++c) {
      const VectorXd column = noise(rows, 30000 + 3 * seed + static_cast<std::uint64_t>(c));
      const FlipCandidate one = candidate_of(column, residual, 40, 0.0);
      option.scores.col(c) = one.options.front().scores;
      option.inverse(c, c) = one.options.front().inverse(0, 0);
      many.gain += std::pow(column.dot(residual), 2) / column.squaredNorm();
    }
    many.options = {option};
    const auto result =
        diagnose::sign_flip_test({candidate_of(alone, residual, 40, gain), many}, 0.2, 9, 499);
    first += result.p_value[0] <= 0.2 ? 1 : 0;
    second += result.p_value[1] <= 0.2 ? 1 : 0;
  }
  // 80 alarms expected of both together (deviation 8), half of them each.
  EXPECT_NEAR(first + second, 80, 30);
  EXPECT_GT(second, 20);
  EXPECT_GT(first, 20);
}

diagnose::SeriesSet series_of(const generator::HiddenPhysics& hidden, const physics::Plant& plant) {
  static std::vector<record::Recording> recordings;
  recordings = {generator::make_recording(hidden, {.duration_s = 240.0})};
  auto set = diagnose::build_series(recordings, {}, plant, {});
  EXPECT_TRUE(set.ok());
  return set.value();
}

TEST(Gates, ASmallEffectIsSeenBesideABigOne) {
  // A null made from a residual that still holds the big effect would hide the small one.
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  const auto set = series_of({.gain = 0.0015, .coupling = 0.2}, plant);
  const auto& series = set.series.front();
  const auto nominal = diagnose::nominal_of(series, plant);
  const auto forms = diagnose::forms_for(series, nominal);
  const auto model = diagnose::prepare_channel(series, nominal, forms);
  EXPECT_LT(model.floor, 5e-4) << "the null must not hold the coupling of 0.05 rad";
  diagnose::ChannelModel chosen = model;
  diagnose::select_effects(chosen, {}, 1);
  std::vector<std::string> ids;
  for (const auto& c : chosen.chosen) ids.push_back(chosen.candidates[c.candidate]->form->key());
  EXPECT_NE(std::find(ids.begin(), ids.end(), "gain_error"), ids.end())
      << ::testing::PrintToString(ids);
  EXPECT_NE(std::find(ids.begin(), ids.end(), "coupling<two"), ids.end())
      << ::testing::PrintToString(ids);
}

/// A limit that was reached in one block of the recording only, or in two.
class Reached final : public diagnose::EffectForm {
 public:
  explicit Reached(bool occasional, int blocks)
      : EffectForm(diagnose::effect_kind("saturation")), occasional_(occasional), blocks_(blocks) {}
  bool occasional() const override { return occasional_; }
  Eigen::MatrixXd columns(const diagnose::Series& s, const diagnose::Shape&) const override {
    const auto blocks = diagnose::make_blocks(s, 12.0);  // as long as the noise asks for
    VectorXd column = VectorXd::Zero(s.rows());
    for (int n = 1; n <= blocks_; ++n) {
      const std::size_t block =
          blocks.count() * static_cast<std::size_t>(n) / static_cast<std::size_t>(blocks_ + 1);
      const Index middle = blocks.first(block) + blocks.size(block) / 2;
      const double middle_s = s.t_s[blocks.rows[static_cast<std::size_t>(middle)]];
      column.array() += (1.0 - (s.t_s.array() - middle_s).abs()).max(0.0);
    }
    return column;
  }
  std::vector<diagnose::FormParameter> parameters(const diagnose::Series&, const diagnose::Shape&,
                                                  const VectorXd&) const override {
    return {};
  }
  std::string separate_by() const override { return ""; }

 private:
  bool occasional_;
  int blocks_;
};

std::size_t chosen_with(double size, bool occasional, int blocks = 1) {
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  diagnose::SeriesSet set = series_of({}, plant);
  diagnose::Series& series = set.series.front();
  diagnose::Forms forms;
  forms.push_back(std::make_unique<Reached>(occasional, blocks));
  series.y += size * forms.front()->columns(series, {}).col(0);
  diagnose::ChannelModel model =
      diagnose::prepare_channel(series, diagnose::nominal_of(series, plant), forms);
  diagnose::select_effects(model, {}, 1);
  return model.chosen.size();
}

TEST(Gates, WhatMayHappenOnceIsRepeatedByItsParts) {
  // Noise is 2e-4 here, and what acts all of the time is asked of more than one block.
  EXPECT_EQ(chosen_with(5e-3, true), 1U);
  EXPECT_EQ(chosen_with(5e-3, false), 0U);
  EXPECT_EQ(chosen_with(0.0, true), 0U);
  EXPECT_TRUE(diagnose::saturation(diagnose::Series{}, {})->occasional());
}

TEST(Gates, WhatTwoStretchesShowEachPredictsTheOther) {
  EXPECT_EQ(chosen_with(5e-3, false, 2), 1U);
}

TEST(Gates, ALoadByPostureHoldsBeyondWhereItWasFitted) {
  constexpr double kOrder = 9.0;  ///< some one and a half waves over the range
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  for (const bool is_load : {true, false}) {
    diagnose::SeriesSet set = series_of({}, plant);
    diagnose::Series& series = set.series.front();
    series.stage = diagnose::Stage::kTracking;
    // A line through the middle of the wave explains some of it and is wrong at both ends.
    const Eigen::ArrayXd q = series.motion.q.array();
    series.y += 0.02 * (is_load ? q : Eigen::ArrayXd((kOrder * q).sin())).matrix();
    diagnose::Forms forms;
    forms.push_back(generator::form_of("gravity"));
    const diagnose::ChannelModel model =
        diagnose::prepare_channel(series, diagnose::nominal_of(series, plant), forms);
    EXPECT_EQ(diagnose::pick(diagnose::screen(model, {}, 1), model, {}).has_value(), is_load);
  }
}

TEST(Gates, NoColumnContainsTheRecordedEffortOrTruth) {
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  const auto set = series_of({.coulomb_n_m = 0.5}, plant);
  ASSERT_EQ(set.series.size(), 2U);
  for (const auto& series : set.series) {
    diagnose::Series other = series;
    other.y = 3.0 * series.y + noise(series.rows(), 4);
    other.recorded = other.y;
    const auto nominal = diagnose::nominal_of(series, plant);
    for (const auto& form : diagnose::forms_for(series, nominal)) {
      if (!form->untestable(series).empty()) continue;
      for (const auto& shape : form->grid(series)) {
        EXPECT_EQ(form->columns(series, shape), form->columns(other, shape)) << form->key();
      }
    }
  }
}

/// Names that a channel with one chosen effect of that size gets, in deviations of its noise.
std::pair<std::size_t, std::size_t> named_and_kept(double size) {
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  diagnose::SeriesSet set = series_of({}, plant);
  diagnose::Series& series = set.series.front();
  const VectorXd column = noise(series.rows(), 77) * std::sqrt(3.0);
  series.y += size * 2e-4 * column;
  diagnose::ChannelFit fit;
  fit.nominal = std::make_shared<diagnose::Nominal>(diagnose::nominal_of(series, plant));
  fit.forms.push_back(std::make_unique<Given>("gain_error", column));
  fit.model = diagnose::prepare_channel(series, *fit.nominal, fit.forms);
  fit.model.chosen.push_back({0, {}, fit.model.blocks.gather(column)});
  fit.model.hold_nominal();
  fit.coefficients = diagnose::joint_fit(fit.model);
  diagnose::ChannelFindings findings;
  diagnose::name_effects(fit, {}, findings);
  return {findings.effects.size(), findings.kept.size()};
}

TEST(Gates, WhatIsTooSmallForANameIsKeptInTheModel) {
  EXPECT_EQ(named_and_kept(2.0), std::pair(std::size_t{1}, std::size_t{0}));
  EXPECT_EQ(named_and_kept(0.3), std::pair(std::size_t{0}, std::size_t{1}));
}

TEST(TorqueRipple, TurnsWithThePartsOfTheDrive) {
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  diagnose::Series series = series_of({.coulomb_n_m = 0.5}, plant).series.back();
  EXPECT_EQ(series.drive_order, 1.0);
  series.drive_order = 10.0;  // a range of 0.9 rad tells orders apart that differ by 3.5
  const auto form = generator::form_of("torque_ripple");
  const VectorXd b = VectorXd::Ones(2);
  EXPECT_EQ(form->inconsistency(series, {20.5}, b), "");
  EXPECT_NE(form->inconsistency(series, {15.0}, b), "");
  EXPECT_NE(form->inconsistency(series, {2.0}, b), "") << "slower than its slowest shaft";
}

TEST(Blocks, NeverReachAcrossARecordingAndCoverEachTrainingRowOnce) {
  const auto plant = physics::parse_plant(generator::plant_text(), "test").value();
  const std::vector<record::Recording> two = {
      generator::make_recording({}, {.seed = 1, .duration_s = 100.0}),
      generator::make_recording({}, {.seed = 2, .duration_s = 100.0})};
  const auto set = diagnose::build_series(two, {}, plant, {});
  ASSERT_TRUE(set.ok());
  const auto& series = set->series.front();
  const auto blocks = diagnose::make_blocks(series, 10.0);
  EXPECT_EQ(blocks.begin.front(), 0);
  EXPECT_EQ(blocks.begin.back(), static_cast<Index>(blocks.rows.size()));
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    ASSERT_GT(blocks.size(b), 0);
    const auto first =
        static_cast<std::size_t>(blocks.rows[static_cast<std::size_t>(blocks.first(b))]);
    const auto last = static_cast<std::size_t>(
        blocks.rows[static_cast<std::size_t>(blocks.first(b) + blocks.size(b) - 1)]);
    EXPECT_EQ(series.recording[first], series.recording[last]);
  }
}

TEST(Operators, DirectionMemoryKeepsItsSideAtRestAndTurnsOverItsWidth) {
  VectorXd q(7);
  q << 0.0, 1.0, 2.0, 2.0, 1.75, 1.5, 1.0;
  const std::vector<char> fresh = {1, 0, 0, 0, 0, 0, 0};
  const VectorXd side = diagnose::direction_memory(q, 1.0, fresh);
  EXPECT_DOUBLE_EQ(side[2], 1.0);
  EXPECT_DOUBLE_EQ(side[3], 1.0);
  EXPECT_DOUBLE_EQ(side[4], 0.5);
  EXPECT_DOUBLE_EQ(side[5], 0.0);
  EXPECT_DOUBLE_EQ(side[6], -1.0);
}

}  // namespace
