// SPDX-License-Identifier: Apache-2.0
#include "study/recommend.hpp"

#include <gtest/gtest.h>

namespace ravencal::study {
namespace {

MethodResult result(const std::string& id, bool loadable, double step_us,
                    std::vector<std::pair<double, double>> minutes_and_error) {
  MethodResult m;
  m.id = id;
  m.title = id;
  m.loop.loadable = loadable;
  m.loop.why_not = loadable ? "" : "convert knows no such thing";
  m.loop.measured = true;
  m.loop.step.p999_us = step_us;
  m.model_file = loadable ? "models/" + id + ".onnx" : "";
  for (const auto& [minutes, error] : minutes_and_error)
    m.curve.push_back({minutes / 20.0, minutes, {error, 2.0 * error}});
  m.joints = {{"elbow", "deg", {}, {}}, {"wrist", "deg", {}, {}}};
  return m;
}

/// A network that is best but slow, a linear one that is quick, a process that cannot be loaded.
Comparison sample() {
  Comparison c;
  c.methods = {result("linear", true, 2.0, {{5, 1.0}, {20, 0.9}}),
               result("network", true, 60.0, {{5, 2.0}, {20, 0.3}}),
               result("gp", false, 40.0, {{5, 0.5}, {20, 0.2}})};
  return c;
}

TEST(Recommend, TakesTheLeastErrorThatCanBeLoadedInTime) {
  const auto r = recommend(sample(), {.step_budget_us = 500.0, .minutes = {}});
  ASSERT_TRUE(r.ok());
  EXPECT_EQ(r->method, "network");
  EXPECT_EQ(r->model_file, "models/network.onnx");
  EXPECT_NE(recommendation_text(*r, "out").find("gp"), std::string::npos)
      << "the better one that cannot be loaded is named";
}

TEST(Recommend, KeepsTheBudgetOfAStep) {
  const auto r = recommend(sample(), {.step_budget_us = 50.0, .minutes = {}});
  ASSERT_TRUE(r.ok());
  EXPECT_EQ(r->method, "linear");
  EXPECT_NE(recommendation_text(*r, "out").find("network (60.0 µs)"), std::string::npos);
}

TEST(Recommend, JudgesByTheTrainingThatTheUserWillRecord) {
  const auto r = recommend(sample(), {.step_budget_us = 500.0, .minutes = 10.0});
  ASSERT_TRUE(r.ok());
  EXPECT_EQ(r->method, "linear") << "with five minutes the network is the worse one";
  EXPECT_EQ(r->minutes, 5.0);
}

TEST(Recommend, SaysWhenTheComparisonKnowsNoTrainingThatShort) {
  const auto r = recommend(sample(), {.step_budget_us = 500.0, .minutes = 1.0});
  ASSERT_TRUE(r.ok());
  EXPECT_NE(recommendation_text(*r, "out").find("no training as short as 1 min"),
            std::string::npos);
}

TEST(Recommend, PrefersTheFasterOfTwoThatAreAsGood) {
  Comparison c = sample();
  c.methods.push_back(result("small", true, 5.0, {{20, 0.303}}));
  EXPECT_EQ(recommend(c, {.step_budget_us = 500.0, .minutes = {}})->method, "small");
}

TEST(Recommend, SaysWhichConstraintExcludesWhich) {
  const auto r = recommend(sample(), {.step_budget_us = 1.0, .minutes = {}});
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().message.find("linear (2.0 µs)"), std::string::npos);
  EXPECT_NE(r.error().message.find("cannot be loaded: gp"), std::string::npos);
}

TEST(Recommend, RefusesWhatCompareDidNotWrite) {
  EXPECT_FALSE(read_comparison("no_such_folder/compare.json").ok());
}

}  // namespace
}  // namespace ravencal::study
