// SPDX-License-Identifier: Apache-2.0
//
// The vocabulary as objects: what every effect must bring so that no room has to know its id.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

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

TEST(EffectKinds, ARecordingPartsTwoEffectsOfWhichOneAnswersToIt) {
  const auto parting = diagnose::cheapest_parting("creep", "thermal_drift");
  ASSERT_TRUE(parting.has_value());
  EXPECT_NE(parting->experiment.find("hold"), std::string::npos);
  EXPECT_FALSE(diagnose::cheapest_parting("creep", "creep").has_value());
}

}  // namespace
