// SPDX-License-Identifier: Apache-2.0
//
// The vocabulary as objects: what every effect must bring so that no room has to know its id.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "diagnose/channel/improved_plant.hpp"
#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/report/suggest.hpp"
#include "physics/effects/effect_spec.hpp"

namespace {

using namespace ravencal;

TEST(EffectKinds, EveryIdIsThereOnceAndFoundByItsName) {
  std::set<std::string> ids;
  for (const diagnose::EffectKind* kind : diagnose::effect_kinds()) {
    EXPECT_TRUE(ids.insert(kind->id()).second) << kind->id();
    EXPECT_EQ(&diagnose::effect_kind(kind->id()), kind);
    EXPECT_FALSE(kind->sentence().empty()) << kind->id();
  }
  EXPECT_EQ(diagnose::effect_kind("no such effect").id(), "unknown");
}

TEST(EffectKinds, WhatCanBeSimulatedCanBeNamed) {
  for (const physics::EffectSpec& spec : physics::effect_specs())
    EXPECT_EQ(diagnose::effect_kind(spec.id).id(), spec.id);
}

TEST(EffectKinds, EachNumberOfTheFreeRunBelongsToOneEffect) {
  std::map<physics::DriveField, int> owners;
  for (const diagnose::EffectKind* kind : diagnose::effect_kinds()) {
    for (const diagnose::DriveParameter& p : kind->drive_parameters()) ++owners[p.field];
  }
  for (int f = 0; f < physics::kDriveFields; ++f) {
    const auto field = static_cast<physics::DriveField>(f);
    if (field == physics::DriveField::kOffset) continue;
    EXPECT_EQ(owners[field], 1) << f;
  }
}

/// Report and channels speak of the same vocabulary.
TEST(EffectKinds, AreSaidByTheTableOfWords) {
  const auto words = diagnose::vocabulary_words();
  ASSERT_EQ(words.size(), diagnose::effect_kinds().size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    const diagnose::EffectKind& kind = *diagnose::effect_kinds()[i];
    const diagnose::Traits& traits = kind.traits();
    EXPECT_EQ(words[i].id, kind.id());
    EXPECT_EQ(words[i].stage, diagnose::stage_word(kind.stage())) << kind.id();
    EXPECT_EQ(words[i].origin, traits.origin) << kind.id();
    EXPECT_EQ(words[i].abscissa, traits.abscissa) << kind.id();
    EXPECT_EQ(words[i].probes, traits.probes) << kind.id();
    EXPECT_EQ(words[i].sentence(), kind.sentence()) << kind.id();
    EXPECT_EQ(words[i].enters_at, traits.enters_at) << kind.id();
    EXPECT_EQ(words[i].on_tool, traits.weight == diagnose::Weight::kOnTool) << kind.id();
  }
}

diagnose::NamedEffect found(const std::string& id, const std::string& joint,
                            const std::string& stage, const std::string& parameter, double value) {
  diagnose::NamedEffect effect;
  effect.id = id;
  effect.joint = joint;
  effect.stage = stage;
  effect.parameters = {{parameter, value, "1", {value, value}}};
  return effect;
}

physics::Plant shipped(const std::string& name) {
  auto plant =
      physics::load_plant(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tools/plants" / name);
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

TEST(ImprovedPlant, MarksWhatNoPlantMayHaveAndDoesWithoutIt) {
  const physics::Plant plant = shipped("raven2_published.toml");
  diagnose::Report report;
  report.effects = {found("payload", "elbow", "drive", "mass", -0.3),
                    found("gravity", "elbow", "drive", "weight_scale", -0.1),
                    found("hysteresis", "elbow", "transmission", "half_loop", 0.1),
                    found("slip", "elbow", "transmission", "size\nmass_kg", 0.01)};
  report.effects[1].out_of_tolerance = true;
  diagnose::improve(plant, report);
  for (const diagnose::NamedEffect& e : report.effects) EXPECT_TRUE(e.beyond_plants) << e.id;
  report.improved.hash = plant.hash;
  EXPECT_EQ(report.improved, plant);
}

/// The recorder's latency is the plant's only where the plant says how it is recorded.
TEST(ImprovedPlant, TakesADelayOfTheSensorForTheRecordersWhereThePlantHasOne) {
  diagnose::Report report;
  report.effects = {found("delay", "carriage", "sensor", "delay", 0.002)};
  physics::Plant plant = shipped("emps.toml");
  EXPECT_EQ(diagnose::improved_plant(plant, report).joints.front().parameter("delay", "delay"),
            0.002);
  plant.logger.given = true;
  const physics::Plant recorded = diagnose::improved_plant(plant, report);
  EXPECT_EQ(recorded.joints.front().find_effect("delay"), nullptr);
  EXPECT_EQ(recorded.logger.truth_latency_s, 0.002);
}

}  // namespace
