// SPDX-License-Identifier: Apache-2.0
//
// The one case of `prove --one`: its draw, its files, and the four outcomes.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/whole_file.hpp"
#include "prove/generator/case.hpp"
#include "prove/one.hpp"
#include "prove/score.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::prove;
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

const Json kHidden = {{"case", 0},
                      {"kind", "single"},
                      {"floors", {{"elbow", {{"position", 1e-4}}}}},
                      {"subjects",
                       {{{"id", "coupling"},
                         {"joint", "elbow"},
                         {"joint_seen", "elbow"},
                         {"from", "shoulder"},
                         {"parameter", "error"},
                         {"value", 0.02},
                         {"channel", "position"},
                         {"size_over_floor", 14.0}}}}};

Json effect(const char* id, const char* joint, const std::vector<std::string>& others = {}) {
  return {
      {"id", id},
      {"joint", joint},
      {"from", "shoulder"},
      {"parameters",
       {{{"name", "error"}, {"value", 0.019}, {"unit", "rad_per_rad"}, {"ci95", {0.018, 0.021}}}}},
      {"evidence", {{"held_out_before", 0.01}, {"held_out_after", 0.001}, {"unit", "rad"}}},
      {"ambiguous_with", others}};
}

OpenedCase opened_with(const std::vector<Json>& effects) {
  const Json verdict = {{"case", 0},
                        {"report",
                         {{"verdict", {{"kind", "named"}}},
                          {"effects", effects},
                          {"held_out",
                           {{{"joint", "elbow"},
                             {"metric", "position_rmse"},
                             {"unit", "rad"},
                             {"before", 0.02},
                             {"after", 0.002}}}}}}};
  return {0, kHidden.dump(), verdict.dump()};
}

Json said(const std::vector<Json>& effects) {
  const auto one = one_json(opened_with(effects));
  EXPECT_TRUE(one.ok());
  return one.value();
}

TEST(ProveOne, FindsTheRightEffectAtTheRightJointOnly) {
  const Json one = said({effect("coupling", "elbow", {"creep"})});
  EXPECT_EQ(one["outcome"], "found");
  EXPECT_EQ(one["found"]["size"]["value"], 0.019);
  EXPECT_EQ(one["held_out"]["after"], 0.001);
  EXPECT_NE(one_text(one).find("not told apart from creep"), std::string::npos) << one_text(one);
  EXPECT_EQ(said({effect("coupling", "insertion")})["outcome"], "missed");
  EXPECT_EQ(said({effect("creep", "elbow")})["outcome"], "missed");
  Json from_another_joint = effect("coupling", "elbow");
  from_another_joint["from"] = "insertion";
  EXPECT_EQ(said({from_another_joint})["outcome"], "missed");
}

TEST(ProveScore, ComparesACouplingWithTheOneFromTheSameJoint) {
  Json from_another_joint = effect("coupling", "elbow");
  from_another_joint["from"] = "insertion";
  from_another_joint["parameters"][0]["value"] = 0.5;
  const auto score = score_case(opened_with({from_another_joint, effect("coupling", "elbow")}));
  ASSERT_TRUE(score.ok());
  EXPECT_NEAR(score->subjects[0].parameter_error.value(), 0.05, 1e-9);
  EXPECT_TRUE(score->subjects[0].covered.value());
}

TEST(ProveScore, TakesAWeightAtTheToolForRightAtAnyJoint) {
  OpenedCase opened = opened_with({effect("payload", "insertion"), effect("creep", "insertion")});
  EXPECT_FALSE(score_case(opened)->subjects[0].named);
  Json manifest = kHidden;
  manifest["subjects"][0]["id"] = "payload";
  opened.manifest = manifest.dump();
  EXPECT_TRUE(score_case(opened)->subjects[0].named);
  manifest["subjects"][0]["id"] = "creep";
  opened.manifest = manifest.dump();
  EXPECT_FALSE(score_case(opened)->subjects[0].named);
}

TEST(ProveOne, IsNoHitWhereFalseNamesStandBeside) {
  for (const auto& [id, joint] :
       {std::pair{"creep", "elbow"}, {"coupling", "insertion"}, {"unknown", "shoulder"}}) {
    const Json one = said({effect(id, joint), effect("coupling", "elbow")});
    EXPECT_EQ(one["outcome"], "found_beside_false_names") << id;
    EXPECT_NE(one_text(one).find(fmt::format("also named: {} at the {}", id, joint)),
              std::string::npos)
        << one_text(one);
  }
}

TEST(ProveOne, TellsALookAlikeAsSuch) {
  const Json one = said({effect("creep", "elbow", {"coupling"})});
  EXPECT_EQ(one["outcome"], "look_alike");
  EXPECT_NE(one_text(one).find("does not tell creep apart from coupling"), std::string::npos);
  EXPECT_EQ(said({effect("creep", "shoulder", {"coupling"})})["outcome"], "missed");
}

TEST(ProveOne, ShowsTheErrorOfTheJointWhereNothingWasFound) {
  const Json one = said({effect("creep", "shoulder")});
  EXPECT_EQ(one["outcome"], "missed");
  EXPECT_TRUE(one["found"].is_null());
  EXPECT_EQ(one["held_out"]["before"], 0.02);
  EXPECT_EQ(one["also_named"][0]["id"], "creep");
}

TEST(ProveOne, SaysWhereTheDiagnosisGaveNoReport) {
  const auto one = one_json({0, kHidden.dump(), R"({"case": 0, "report": null, "log": "crash"})"});
  ASSERT_TRUE(one.ok());
  EXPECT_EQ(one.value()["outcome"], "missed");
  EXPECT_NE(one_text(one.value()).find("no report"), std::string::npos);
}

TEST(ProveOne, RefusesACaseThatDoesNotHideOneEffect) {
  EXPECT_FALSE(one_json({0, R"({"case": 0, "subjects": []})", R"({"report": null})"}).ok());
}

TEST(ProveOne, DrawsEveryKindAndTheSameForTheSameSeed) {
  std::set<std::string_view> kinds;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const CaseOptions options{seed, 20.0, 10.0};
    const CaseDesign design = draw_gross_case(0, options), again = draw_gross_case(0, options);
    ASSERT_EQ(design.subjects.size(), 1U);
    EXPECT_EQ(design.subjects[0].kind, again.subjects[0].kind);
    EXPECT_EQ(design.subjects[0].amplitude, again.subjects[0].amplitude);
    kinds.insert(design.subjects[0].kind->id);
  }
  EXPECT_EQ(kinds.size(), vocabulary_kinds().size());
}

/// A tool that prints a report and a page, and finds nothing.
TEST(ProveOne, KeepsWhatTheUserLooksAtAndMakesTheSameFilesOfTheSameSeed) {
  const fs::path root = fs::temp_directory_path() / fmt::format("prove-one-{}", ::getpid());
  fs::remove_all(root);
  fs::create_directories(root);
  ProofOptions options;
  options.tool = root / "tool";
  ASSERT_TRUE(core::write_whole_file(options.tool,
                                     "#!/bin/sh\nmkdir diagnosis\n"
                                     "echo page > diagnosis/report.html\n"
                                     "echo '{\"effects\":[]}' > verdict.json\n")
                  .ok());
  fs::permissions(options.tool, fs::perms::owner_all);
  options.cases = 1;
  options.seed = 3;
  options.duration_s = 20.0;
  options.held_out_s = 10.0;
  options.one = options.keep_recordings = true;
  for (const char* name : {"a", "b"}) {
    options.out = root / name;
    ASSERT_TRUE(seal_cases(options).ok());
    ASSERT_TRUE(run_cases(options).ok());
    EXPECT_EQ(core::read_whole_file(options.out / "diagnosis/report.html").value(), "page\n");
    const auto opened = open_cases(options.out);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    const auto one = one_json(opened.value().front());
    ASSERT_TRUE(one.ok());
    EXPECT_GE(one.value()["hidden"]["size_over_floor"].get<double>(), kLargestClass);
  }
  for (const char* file : {"recording.db", "held_out.db", "plant.toml"})
    EXPECT_EQ(core::read_whole_file(root / "a/given/0000" / file).value(),
              core::read_whole_file(root / "b/given/0000" / file).value())
        << file;
  fs::remove_all(root);
}

}  // namespace
