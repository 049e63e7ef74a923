// SPDX-License-Identifier: Apache-2.0
//
// What is too small for a name and still predicts better is in the improved plant; where nothing is
// hidden, nothing is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose_generator.hpp"

namespace ravencal::diagnose {
namespace {

Report diagnosed(const generator::HiddenPhysics& hidden, std::uint64_t seed) {
  generator::Scene scene;
  scene.seed = seed;
  scene.with_torque = false;
  const auto plant = physics::parse_plant(generator::plant_text(), "generated.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  Options options;
  options.threads = 1;
  auto report = diagnose({generator::make_recording(hidden, scene)}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return std::move(report).value();
}

/// Held-out error of joint "one" with what was found, and its floor.
HeldOut error_of(const Report& report) {
  const auto it = std::find_if(
      report.held_out.begin(), report.held_out.end(),
      [](const HeldOut& h) { return h.joint == "one" && h.metric == "position_rmse"; });
  EXPECT_NE(it, report.held_out.end());
  return it == report.held_out.end() ? HeldOut{} : *it;
}

bool is_coupling(const NamedEffect& e) { return e.id == "coupling" && e.joint == "one"; }

TEST(Kept, AnEffectOfAThirdOfTheFloorIsUsedWithoutAName) {
  // Zig-zags between -0.5 and 0.5 rad have an RMS of 0.29 rad; names begin at half the floor.
  const double floor = error_of(diagnosed({}, 4)).floor;
  generator::HiddenPhysics hidden;
  hidden.coupling = 0.33 * floor / 0.29;
  const Report report = diagnosed(hidden, 4);
  EXPECT_TRUE(std::none_of(report.effects.begin(), report.effects.end(), is_coupling));
  const auto kept = std::find_if(report.kept.begin(), report.kept.end(), is_coupling);
  ASSERT_NE(kept, report.kept.end());
  EXPECT_NEAR(kept->parameters.front().value, hidden.coupling, 0.35 * hidden.coupling);
  EXPECT_LT(error_of(report).after, 1.02 * floor);
  EXPECT_NE(report.verdict.text.find("kept without a name"), std::string::npos);
  const auto json = nlohmann::json::parse(report_json(report));
  EXPECT_EQ(json["kept_without_name"].size(), report.kept.size());
}

TEST(Kept, NothingWhereNothingIsHidden) {
  for (const std::uint64_t seed : {4, 5, 6}) EXPECT_TRUE(diagnosed({}, seed).kept.empty()) << seed;
}

}  // namespace
}  // namespace ravencal::diagnose
