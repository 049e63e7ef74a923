// SPDX-License-Identifier: Apache-2.0
//
// What a plant states is read as it is stated, and no bound keeps what it does not state from being
// said.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"
#include "diagnose_generated.hpp"

namespace ravencal::diagnose {
namespace {

const Parameter& number_of(const Vocabulary& vocabulary, const std::string& effect,
                           const std::string& name) {
  for (const Parameter& number : vocabulary.numbers)
    if (number.effect == effect && number.name == name && number.joint == 0) return number;
  ADD_FAILURE() << effect << "." << name;
  return vocabulary.numbers.front();
}

Vocabulary vocabulary_for(const std::string& joint) {
  const auto plant = physics::parse_plant(generator::plant_text(joint), "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  std::vector<Track> tracks;
  tracks.push_back(*make_track(generator::make_recording({}, {}), *plant, 0.0, 1e9));
  Likelihood likelihood(*plant, std::move(tracks));
  return vocabulary_of(*plant, likelihood, nullptr);
}

const NamedEffect* named(const Report& report, const std::string& id) {
  for (const NamedEffect& effect : report.effects)
    if (effect.id == id) return &effect;
  return nullptr;
}

TEST(Statements, DeviationOfHomingIsAStandardDeviationWithoutEnd) {
  const Vocabulary vocabulary =
      vocabulary_for("[[joint.effect]]\nid = \"homing_offset\"\ndeviation_rad = 0.01\n");
  const Parameter& constant = number_of(vocabulary, "encoder", "constant");
  EXPECT_DOUBLE_EQ(constant.deviation * constant.scale, 0.01);
  EXPECT_EQ(constant.high, std::numeric_limits<double>::infinity());
}

TEST(Statements, TolerancesOfEveryNumberAreRead) {
  const Vocabulary usual = vocabulary_for("");
  const Vocabulary wide =
      vocabulary_for("[joint.tolerance]\ninertia = 0.4\ntorque_constant = 0.3\n");
  for (const char* id : {"inertia_error", "torque_constant"}) {
    const double stated = std::string(id) == "inertia_error" ? 0.4 : 0.3;
    EXPECT_NEAR(number_of(wide, id, "ratio").deviation / number_of(usual, id, "ratio").deviation,
                stated / 0.1, 1e-9)
        << id;
  }
}

class WaveOfAnyOrder : public ::testing::TestWithParam<double> {};

TEST_P(WaveOfAnyOrder, IsNamedWithItsOrderAndAmplitude) {
  const Report report = diagnosed(
      generator::make_recording({.wave_rad = 1e-3, .wave_order = GetParam()}, {.rate_hz = 50.0}));
  const NamedEffect* wave = named(report, "eccentricity");
  ASSERT_NE(wave, nullptr) << report.verdict.text;
  for (const NamedParameter& p : wave->parameters) {
    const double truth = p.name == "amplitude" ? 1e-3 : GetParam();
    if (p.name != "phase") {
      EXPECT_NEAR(p.value, truth, 0.1 * truth) << p.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, WaveOfAnyOrder, ::testing::Values(17.3, 41.9, 72.0));

}  // namespace
}  // namespace ravencal::diagnose
