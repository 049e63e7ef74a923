// SPDX-License-Identifier: Apache-2.0
//
// Hiding an effect in a plant, and what counts as found.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "conceal/conceal.hpp"
#include "conceal/kinds.hpp"
#include "conceal/reveal.hpp"

namespace ravencal::conceal {
namespace {

namespace fs = std::filesystem;

const std::string kPublished =
    std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2_published.toml";
const std::string kTuned = std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml";

physics::Plant plant(const std::string& path) {
  auto loaded = physics::load_plant(path);
  EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : loaded.error().message);
  return std::move(loaded).value();
}

Hidden hide(const physics::Plant& nominal, std::uint64_t seed) {
  trajectory::RandomOptions motion;
  motion.duration_s = 10.0;
  motion.pace = 4.0;
  const fs::path scratch =
      fs::temp_directory_path() / ("ravencal_conceal_" + std::to_string(::getpid()) + ".db");
  auto hidden =
      conceal(nominal, *trajectory::make_random(motion), seed, scratch, [] { return true; });
  EXPECT_TRUE(hidden.ok()) << (hidden.ok() ? "" : hidden.error().message);
  EXPECT_FALSE(fs::exists(scratch));
  return std::move(hidden).value();
}

TEST(Conceal, OffersAJointOnlyWhatItLacks) {
  for (const std::string& path : {kPublished, kTuned}) {
    const physics::Plant nominal = plant(path);
    for (const Kind& kind : kinds()) {
      ASSERT_NE(physics::find_effect_spec(kind.id), nullptr) << kind.id;
      for (const std::size_t joint : joints_without(kind, nominal))
        EXPECT_EQ(nominal.joints[joint].find_effect(kind.id), nullptr) << kind.id;
    }
  }
}

TEST(Conceal, HidesTheSameForTheSameSeedAndWritesAPlantThatReadsBack) {
  const physics::Plant nominal = plant(kPublished);
  const Hidden hidden = hide(nominal, 3);
  const Hidden again = hide(nominal, 3);
  EXPECT_EQ(hidden.effect.id, again.effect.id);
  EXPECT_EQ(hidden.effect.parameters, again.effect.parameters);
  const auto text = hidden_plant(kPublished, nominal, hidden);
  ASSERT_TRUE(text.ok()) << text.error().message;
  const auto changed = physics::parse_plant(*text, "hidden.toml");
  ASSERT_TRUE(changed.ok()) << changed.error().message;
  for (std::size_t i = 0; i < nominal.joints.size(); ++i) {
    const std::size_t more = i == hidden.joint ? 1 : 0;
    ASSERT_EQ(changed->joints[i].effects.size(), nominal.joints[i].effects.size() + more);
  }
  const physics::Effect& written = changed->joints[hidden.joint].effects.back();
  EXPECT_EQ(written.id, hidden.effect.id);
  EXPECT_EQ(written.from, hidden.effect.from);
  for (const auto& [name, value] : hidden.effect.parameters)
    EXPECT_NEAR(written.parameters.at(name), value, 1e-9 * std::abs(value)) << name;
}

TEST(Conceal, ChoosesSizesByWhatTwoRunsOfThePlantDifferBy) {
  const physics::Plant nominal = plant(kPublished);
  for (const std::uint64_t seed : {1, 2}) {
    const Hidden hidden = hide(nominal, seed);
    EXPECT_GE(hidden.visibility.most(), 0.8 * kLeastSize) << hidden.effect.id;
    EXPECT_LE(hidden.visibility.most(), 1.25 * kMostSize) << hidden.effect.id;
  }
}

const std::string kAnswer = R"({"schema": 1, "seed": 7, "joint": "elbow", "id": "coupling",
  "from": "shoulder", "parameters": [{"name": "error", "value": 0.02, "unit": "rad_per_rad"}],
  "drawn": "error", "shows_in": "position", "scatters": 12.0})";

std::string report(const std::string& id, const std::string& joint, const std::string& parameter,
                   const std::string& ambiguous_with) {
  return R"({"verdict": {"kind": "named"}, "effects": [{"id": ")" + id + R"(", "joint": ")" +
         joint + R"(", "parameters": [{"name": ")" + parameter +
         R"(", "value": 0.019, "unit": "rad_per_rad", "ci95": [0.018, 0.021]}],
         "evidence": {"held_out_before": 0.01, "held_out_after": 0.001, "unit": "rad"},
         "ambiguous_with": [)" +
         ambiguous_with + R"(]}], "held_out": [{"joint": "elbow", "metric": "position_rmse",
         "unit": "rad", "before": 0.02, "after": 0.002}]})";
}

Outcome outcome(const std::string& text) {
  const auto revealed = reveal(kAnswer, text);
  EXPECT_TRUE(revealed.ok());
  return revealed->outcome;
}

TEST(Reveal, CountsTheRightEffectAtTheRightJointOnly) {
  EXPECT_EQ(outcome(report("coupling", "elbow", "error_from_shoulder", "")), Outcome::kFound);
  EXPECT_EQ(outcome(report("coupling", "insertion", "error_from_shoulder", "")), Outcome::kMissed);
  EXPECT_EQ(outcome(report("coupling", "elbow", "error_from_insertion", "")), Outcome::kMissed);
  EXPECT_EQ(outcome(report("creep", "elbow", "compliance", "")), Outcome::kMissed);
}

TEST(Reveal, IsNoHitWhereFalseNamesStandBeside) {
  auto json = nlohmann::json::parse(report("coupling", "elbow", "error_from_shoulder", ""));
  for (const auto& [id, joint] :
       {std::pair{"creep", "elbow"}, {"coupling", "insertion"}, {"gain_error", "shoulder"}}) {
    json["effects"].push_back({{"id", id}, {"joint", joint}, {"parameters", {}}});
    const auto revealed = reveal(kAnswer, json.dump());
    ASSERT_TRUE(revealed.ok());
    EXPECT_EQ(revealed->outcome, Outcome::kFoundBeside) << id;
    EXPECT_EQ(nlohmann::json::parse(reveal_json(*revealed))["outcome"], "found_beside_false_names");
    EXPECT_NE(reveal_table(*revealed).find(std::string("also named: ") + id + " at the " + joint),
              std::string::npos)
        << reveal_table(*revealed);
    json["effects"].erase(1);
  }
}

TEST(Reveal, TellsALookAlikeAsSuch) {
  EXPECT_EQ(outcome(report("creep", "elbow", "compliance", R"("coupling")")), Outcome::kLookAlike);
  const auto revealed =
      reveal(kAnswer, report("coupling", "elbow", "error_from_shoulder", R"("creep")"));
  ASSERT_TRUE(revealed.ok());
  EXPECT_EQ(revealed->outcome, Outcome::kFound);
  EXPECT_NE(reveal_table(*revealed).find("not told apart from creep"), std::string::npos);
}

TEST(Reveal, ShowsTheErrorOfTheJointWhereNothingWasFound) {
  const auto revealed = reveal(kAnswer, report("creep", "shoulder", "compliance", ""));
  ASSERT_TRUE(revealed.ok());
  ASSERT_TRUE(revealed->error);
  EXPECT_EQ(revealed->error->before, 0.02);
  const auto json = nlohmann::json::parse(reveal_json(*revealed));
  EXPECT_EQ(json["outcome"], "missed");
  EXPECT_EQ(json["also_named"][0]["id"], "creep");
}

TEST(Reveal, RefusesFilesOfOthers) {
  EXPECT_FALSE(reveal("{}", "{}").ok());
  EXPECT_FALSE(reveal(kAnswer, "[1]").ok());
}

}  // namespace
}  // namespace ravencal::conceal
