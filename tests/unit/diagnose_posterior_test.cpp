// SPDX-License-Identifier: Apache-2.0
//
// Probabilities of names: what they must be where the answer is known.
#include <gtest/gtest.h>

#include <cmath>

#include "diagnose/selection/posterior.hpp"

namespace {

using namespace ravencal;
using diagnose::Alternative;
using Eigen::VectorXd;

constexpr Eigen::Index kBlocks = 40;

Alternative same_everywhere(const char* id, double error_per_block, double cost = 0.0) {
  return {id, VectorXd::Constant(kBlocks, error_per_block), cost};
}

TEST(Posterior, IsOneHalfOfTwoThatExplainAsMuchForTheSameCost) {
  const auto p = diagnose::weigh(
      {same_everywhere("creep", 1.0), same_everywhere("", 9.0), same_everywhere("hysteresis", 1.0)},
      {}, 1.0, 1);
  EXPECT_NEAR(p.probability, 0.5, 1e-6);
  EXPECT_EQ(p.credible_others(0.95), std::vector<std::string>{"hysteresis"});
}

TEST(Posterior, FollowsTheOddsOfTheCosts) {
  // Twice the log of 20 : 1.
  const auto p = diagnose::weigh(
      {same_everywhere("creep", 1.0), same_everywhere("hysteresis", 1.0, 2.0 * std::log(20.0))}, {},
      1.0, 1);
  EXPECT_NEAR(p.probability, 20.0 / 21.0, 1e-6);
  EXPECT_TRUE(p.credible_others(0.95).empty());
  EXPECT_EQ(p.credible_others(0.96).size(), 1U);
}

TEST(Posterior, IsSmallWhereNothingExplainsAsMuch) {
  const auto p =
      diagnose::weigh({same_everywhere("creep", 1.0, 10.0), same_everywhere("", 1.0)}, {}, 1.0, 1);
  EXPECT_NEAR(p.probability, 1.0 / (1.0 + std::exp(5.0)), 1e-6);
  EXPECT_NEAR(p.in_place, 1.0, 1e-9) << "nothing else stands there";
}

TEST(Posterior, SharesItsWeightWithWhatMakesTheSameColumns) {
  const auto p = diagnose::weigh({same_everywhere("gravity", 1.0), same_everywhere("", 9.0)},
                                 {"payload"}, 1.0, 1);
  EXPECT_NEAR(p.probability, 0.5, 1e-6);
  EXPECT_EQ(p.credible_others(0.95), std::vector<std::string>{"payload"});
}

/// One block that speaks for an effect against all the others is no certainty, whatever it says.
TEST(Posterior, DoesNotLetOneBlockDecide) {
  Alternative rival = same_everywhere("hysteresis", 1.0);
  Alternative own = same_everywhere("creep", 1.2);
  own.errors[7] -= 30.0;
  const auto p = diagnose::weigh({own, rival}, {}, 1.0, 1);
  const double by_sums = 1.0 / (1.0 + std::exp(0.5 * (own.errors.sum() - rival.errors.sum())));
  EXPECT_GT(by_sums, 0.999);
  EXPECT_LT(p.probability, 0.9);
  EXPECT_GT(p.probability, 0.5);
}

/// A difference below what two simulations of the same cable differ by is none.
TEST(Posterior, LeavesOpenWhatTheFormOfASimulationLeavesOpen) {
  const auto with_form = [](double form_error) {
    Alternative own = same_everywhere("creep", 1.0);
    Alternative rival = same_everywhere("hysteresis", 1.5);
    own.form_error = rival.form_error = form_error;
    return diagnose::weigh({own, rival}, {}, 1.0, 1).probability;
  };
  EXPECT_GT(with_form(0.0), 0.999);
  EXPECT_LT(with_form(40.0), 0.8);
  EXPECT_GT(with_form(40.0), 0.5);
}

TEST(Posterior, IsTheSameForTheSameSeed) {
  Alternative own = same_everywhere("creep", 1.0);
  own.errors[3] = 4.0;
  const std::vector<Alternative> all = {own, same_everywhere("", 1.2)};
  EXPECT_EQ(diagnose::weigh(all, {}, 1.0, 5).probability,
            diagnose::weigh(all, {}, 1.0, 5).probability);
}

TEST(Posterior, OfAChanceFallsWithIt) {
  EXPECT_GT(diagnose::probability_at(1e-6), 0.99);
  EXPECT_LT(diagnose::probability_at(0.05), 0.1);
  EXPECT_NEAR(diagnose::probability_at(0.9), diagnose::probability_at(0.5), 1e-12)
      << "nothing speaks for an effect above 1/e";
}

}  // namespace
