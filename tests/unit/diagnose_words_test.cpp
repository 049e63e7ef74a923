// SPDX-License-Identifier: Apache-2.0
//
// What is said of each effect of the vocabulary, and the recordings that part two of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/findings/sides.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::diagnose {
namespace {

TEST(EffectWords, AreThereOnceForEachIdAndFoundByIt) {
  std::set<std::string_view> ids;
  for (const EffectWords& words : vocabulary_words()) {
    EXPECT_TRUE(ids.insert(words.id).second) << words.id;
    EXPECT_EQ(&words_for(words.id), &words);
  }
  EXPECT_EQ(ids.size(), 36U);
  EXPECT_EQ(vocabulary_words().back().id, kUnknown);
  EXPECT_EQ(words_for("no such effect").id, kUnknown);
}

TEST(EffectWords, SayWhatItDoesWhereItStandsAndWhatPartsIt) {
  const std::set<std::string_view> stages = {"transmission", "drive", "command"};
  for (const EffectWords& words : vocabulary_words()) {
    EXPECT_FALSE(words.sentence().empty()) << words.id;
    EXPECT_FALSE(words.separate_by.empty()) << words.id;
    EXPECT_TRUE(stages.contains(words.stage)) << words.id;
    for (const std::string_view other : words.look_alikes) {
      EXPECT_EQ(words_for(other).id, other) << words.id;
      EXPECT_NE(other, words.id);
    }
  }
  EXPECT_TRUE(words_for("payload").on_tool);
}

/// One sentence, in one place.
TEST(EffectWords, TakeTheSentenceOfThePlantsVocabularyWhereItHasOne) {
  for (const physics::EffectSpec& spec : physics::effect_specs()) {
    ASSERT_EQ(words_for(spec.id).id, spec.id);
    EXPECT_TRUE(words_for(spec.id).own_sentence.empty()) << spec.id;
    EXPECT_EQ(words_for(spec.id).sentence(), spec.sentence);
  }
}

TEST(Sides, AreSaidAsFarAsTwoEncodersDecideThem) {
  const auto gap = sides_of(words_for("backlash"), {.joint_seen = true, .geared = true});
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->encoder, "joint");
  EXPECT_EQ(gap->gearbox, "undecided");
  EXPECT_NE(gap->decided_by.find("hold the gearbox's output"), std::string::npos);
  const auto direct = sides_of(words_for("backlash"), {.joint_seen = true});
  EXPECT_EQ(direct->gearbox, "none");
  EXPECT_TRUE(direct->decided_by.empty()) << direct->decided_by;
}

TEST(Sides, OfFrictionTakeACableThatItCouldStretch) {
  const EffectWords& dry = words_for("coulomb_friction");
  EXPECT_EQ(sides_of(dry, {.joint_seen = true, .yields = true})->encoder, "motor");
  EXPECT_EQ(sides_of(dry, {.joint_seen = true})->encoder, "undecided");
  const auto blind = sides_of(dry, {.yields = true});
  EXPECT_EQ(blind->encoder, "undecided");
  EXPECT_NE(blind->decided_by.find("record the joint"), std::string::npos);
  EXPECT_FALSE(sides_of(words_for("delay"), {.joint_seen = true}));
}

TEST(Experiments, PartTwoEffectsOfWhichOneAnswers) {
  const Experiment* parting = cheapest_parting("creep", "thermal_drift");
  ASSERT_NE(parting, nullptr);
  EXPECT_EQ(parting->probe, Probe::kHolds);
  EXPECT_EQ(cheapest_parting("creep", "creep"), nullptr);
  EXPECT_EQ(cheapest_test("quantisation"), nullptr);
}

TEST(Experiments, AreNamedOnceForAllRivals) {
  const std::string hold(cheapest_parting("creep", "thermal_drift")->experiment);
  EXPECT_EQ(experiment_that_parts("creep", {"thermal_drift"}), hold);
  // Both answer to the same recording, and neither does creep.
  EXPECT_EQ(experiment_that_parts("creep", {"viscous_friction", "stribeck_friction"}),
            cheapest_parting("creep", "viscous_friction")->experiment);
  const std::string both = experiment_that_parts("creep", {"thermal_drift", "backlash"});
  EXPECT_EQ(both, hold + "; " + std::string(cheapest_parting("creep", "backlash")->experiment));
}

TEST(Experiments, AreTheEffectsOwnWhereTheMenuPartsNothing) {
  EXPECT_EQ(experiment_that_parts("slip", {"lost_counts"}), words_for("slip").separate_by);
}

}  // namespace
}  // namespace ravencal::diagnose
