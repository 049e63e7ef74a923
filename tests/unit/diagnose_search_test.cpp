// SPDX-License-Identifier: Apache-2.0
//
// The search for a channel's model, on columns whose truth is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/selection/contenders.hpp"
#include "diagnose/selection/posterior.hpp"
#include "diagnose/selection/search.hpp"
#include "diagnose_form.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;
using generator::Given;
using generator::noise;

const physics::Plant& plant() {
  static const physics::Plant kPlant =
      physics::parse_plant(generator::plant_text(), "test").value();
  return kPlant;
}

/// The first channel, a transmission, of a recording with nothing in it.
diagnose::Series clean_series() {
  const auto set = diagnose::build_series({generator::make_recording({}, {.duration_s = 240.0})},
                                          {}, plant(), {});
  return set.value().series.front();
}

diagnose::ChannelModel prepared(const diagnose::Series& series, const diagnose::Forms& forms) {
  return diagnose::prepare_channel(series, diagnose::nominal_of(series, plant()), forms);
}

/// Ids of the model's effects, sorted.
std::vector<std::string> ids_of(const diagnose::ChannelModel& model) {
  std::vector<std::string> ids;
  for (const auto& chosen : model.chosen)
    ids.push_back(model.candidates[chosen.candidate]->form->id());
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// Ids of what the search chooses, sorted.
std::vector<std::string> chosen_from(const diagnose::Series& series, const diagnose::Forms& forms) {
  diagnose::ChannelModel model = prepared(series, forms);
  diagnose::select_effects(model, {}, 1);
  return ids_of(model);
}

TEST(Search, AsksTwoEffectsTogetherWhereEitherHidesTheOthersRepetition) {
  // Columns that are much alike and act against each other, each more in some blocks than in
  // others: what one alone gains where it is the larger, it loses where the other is.
  for (const double size : {1e-3, 0.0}) {
    diagnose::Series series = clean_series();
    const Index rows = series.rows();
    const VectorXd level_one = noise(rows, 103), level_two = noise(rows, 203);
    VectorXd one = noise(rows, 303);
    VectorXd two = 0.8 * one + 0.6 * noise(rows, 403);
    for (Index i = 0; i < rows; ++i) {
      one[i] *= std::exp(1.5 * level_one[i / 100]);
      two[i] *= std::exp(1.5 * level_two[i / 100]);
    }
    one.normalize();
    two.normalize();
    series.y += size * std::sqrt(static_cast<double>(rows)) * (one - two);
    diagnose::Forms forms;
    forms.push_back(std::make_unique<Given>("gain_error", one));
    forms.push_back(std::make_unique<Given>("compliance", two));
    forms.push_back(std::make_unique<Given>("delay", noise(rows, 23)));
    diagnose::ChannelModel model = prepared(series, forms);
    EXPECT_FALSE(diagnose::pick(diagnose::screen(model, {}, 1), model, {}).has_value());
    diagnose::select_effects(model, {}, 1);
    EXPECT_EQ(model.chosen.size(), size > 0.0 ? 2U : 0U);
  }
}

TEST(Search, FindsTwoEffectsThatUndoEachOther) {
  // Either alone takes 1.5 % off the error, both together nearly all of it: a stream that is late
  // lags the motion as strands run ahead of it.
  for (const double size : {4e-3, 0.0}) {
    diagnose::Series series = clean_series();
    const Index rows = series.rows();
    const VectorXd one = noise(rows, 303).normalized();
    const VectorXd two = (0.97 * one + 0.2431 * noise(rows, 403).normalized()).normalized();
    series.y += size * std::sqrt(static_cast<double>(rows)) * (one - two);
    diagnose::Forms forms;
    forms.push_back(std::make_unique<Given>("hysteresis", one));
    forms.push_back(std::make_unique<Given>("delay", two));
    forms.push_back(std::make_unique<Given>("gain_error", noise(rows, 23)));
    diagnose::ChannelModel model = prepared(series, forms);
    diagnose::select_effects(model, {}, 1);
    ASSERT_EQ(model.chosen.size(), size > 0.0 ? 2U : 0U);
    for (const auto& chosen : model.chosen) EXPECT_LT(chosen.candidate, 2U);
  }
}

TEST(Search, LeavesABeginningThatImitatesTwoEffects) {
  diagnose::Series series = clean_series();
  const Index rows = series.rows();
  const VectorXd one = noise(rows, 303).normalized(), two = noise(rows, 403).normalized();
  const VectorXd mix = (one + two + 0.5 * noise(rows, 503).normalized()).normalized();
  series.y += 4e-3 * std::sqrt(static_cast<double>(rows)) * (one + two);
  diagnose::Forms forms;
  forms.push_back(std::make_unique<Given>("gain_error", mix));
  forms.push_back(std::make_unique<Given>("compliance", one));
  forms.push_back(std::make_unique<Given>("delay", two));
  EXPECT_EQ(chosen_from(series, forms), (std::vector<std::string>{"compliance", "delay"}));
}

TEST(Search, TakesAWrongNumberBeforeMissingPhysicsUnlessThatIsClearlyLikelier) {
  // Two columns that are much alike: the effect is the second one, of which the first says nearly
  // all where the effect is small.
  for (const auto& [size, expected] :
       {std::pair{3e-4, "gain_error"}, std::pair{1e-2, "compliance"}}) {
    diagnose::Series series = clean_series();
    const Index rows = series.rows();
    const VectorXd column = noise(rows, 303).normalized();
    const VectorXd like = (column + 0.005 * noise(rows, 403).normalized()).normalized();
    series.y += size * std::sqrt(static_cast<double>(rows)) * column;
    diagnose::Forms forms;
    forms.push_back(std::make_unique<Given>("gain_error", like, true));
    forms.push_back(std::make_unique<Given>("compliance", column));
    EXPECT_EQ(chosen_from(series, forms), std::vector<std::string>{expected}) << size;
  }
}

TEST(Search, ReachesModelsInTheOrderOfTheirScore) {
  // Columns that are ever less like the effect, and one that has nothing of it.
  diagnose::Series series = clean_series();
  const Index rows = series.rows();
  const VectorXd effect = noise(rows, 303).normalized();
  const VectorXd other = noise(rows, 403).normalized();
  series.y += 4e-3 * std::sqrt(static_cast<double>(rows)) * effect;
  const std::pair<const char*, VectorXd> columns[] = {{"creep", other},
                                                      {"delay", effect + 0.6 * other},
                                                      {"gain_error", effect + 0.3 * other},
                                                      {"compliance", effect}};
  diagnose::Forms all;
  std::vector<diagnose::ChannelModel> models;  // of one column each, worst first
  for (const auto& [id, column] : columns) {
    diagnose::Forms one;
    one.push_back(std::make_unique<Given>(id, column));
    all.push_back(one.front());
    models.push_back(prepared(series, one));
    diagnose::select_effects(models.back(), {}, 1);
  }
  diagnose::sort_by_score(models);
  ASSERT_EQ(models.size(), 4U);
  EXPECT_EQ(ids_of(models[0]), std::vector<std::string>{"compliance"});
  EXPECT_EQ(ids_of(models[1]), std::vector<std::string>{"gain_error"});
  EXPECT_EQ(ids_of(models[2]), std::vector<std::string>{"delay"});
  EXPECT_EQ(ids_of(models[3]), std::vector<std::string>{});
  EXPECT_EQ(ids_of(diagnose::search_effects(prepared(series, all), {}, 1).front()),
            std::vector<std::string>{"compliance"});
}

TEST(Hypotheses, HoldAStepWhereThereIsOneAndAreSureOfIt) {
  for (const double size : {2e-3, 0.0}) {
    diagnose::Series series = clean_series();
    ASSERT_EQ(series.stage, diagnose::Stage::kTransmission);
    series.y.tail(series.rows() / 3).array() += size;
    diagnose::ChannelFit fit;
    fit.series = std::make_shared<diagnose::Series>(series);
    *fit.nominal = diagnose::nominal_of(series, plant());
    fit.forms.push_back(std::make_unique<Given>("gain_error", noise(series.rows(), 23)));
    fit.model = diagnose::prepare_channel(*fit.series, *fit.nominal, fit.forms);
    std::vector<std::string> notes;
    diagnose::choose_model(fit, plant(), {}, notes);
    ASSERT_EQ(fit.model.steps.size(), size > 0.0 ? 1U : 0U);
    if (size == 0.0) continue;
    EXPECT_NEAR(fit.coefficients[fit.model.step_at(0)], size, 0.1 * size);
    const auto sure = diagnose::posterior_of_step(fit.model, 0, "slip", {}, 1);
    EXPECT_GT(sure.probability, 0.99);
    const auto either = diagnose::posterior_of_step(fit.model, 0, "slip", {"lost_counts"}, 1);
    EXPECT_NEAR(either.probability, 0.5, 0.01);
    EXPECT_EQ(either.credible_others(diagnose::kCredible), std::vector<std::string>{"lost_counts"});
  }
}

}  // namespace
