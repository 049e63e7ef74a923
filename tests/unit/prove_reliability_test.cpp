// SPDX-License-Identifier: Apache-2.0
//
// The table that asks whether probabilities mean what they say.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prove/reliability.hpp"

namespace {

using namespace ravencal::prove;

CaseScore case_of(const std::string& world, double probability, bool hidden) {
  CaseScore score;
  score.world = world;
  Name name{"creep", "elbow", "transmission"};
  name.probability = probability;
  name.hidden = hidden;
  score.names = {name};
  return score;
}

TEST(Reliability, CountsEachWorldAndRangeApart) {
  std::vector<CaseScore> scores;
  for (int n = 0; n < 10; ++n) scores.push_back(case_of("own arm", 0.95, n < 9));
  scores.push_back(case_of("MuJoCo arm", 0.95, false));
  scores.push_back(case_of("own arm", 1.0, true));
  const auto table = reliability_json(scores);
  ASSERT_EQ(table.size(), 3U);
  EXPECT_EQ(table[0]["world"], "MuJoCo arm");
  EXPECT_EQ(table[0]["share_there"], 0.0);
  EXPECT_EQ(table[1]["world"], "own arm");
  EXPECT_EQ(table[1]["said"], 10);
  EXPECT_NEAR(table[1]["mean_said"].get<double>(), 0.95, 1e-12);
  EXPECT_NEAR(table[1]["share_there"].get<double>(), 0.9, 1e-12);
  EXPECT_EQ(table[2]["from"], 0.97);
  EXPECT_EQ(table[2]["said"], 1);
  EXPECT_NE(reliability_text(table).find("MuJoCo arm"), std::string::npos);
}

TEST(Reliability, LeavesOutParametersAndNamesWithoutAProbability) {
  CaseScore parameter = case_of("own arm", 0.9, true), silent = case_of("own arm", 0.9, true);
  parameter.names.front().parameter = true;
  silent.names.front().probability.reset();
  const auto table = reliability_json({parameter, silent});
  EXPECT_TRUE(table.empty());
  EXPECT_EQ(reliability_text(table), "");
}

}  // namespace
