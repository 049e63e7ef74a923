// SPDX-License-Identifier: Apache-2.0
//
// Seals that hold, scores that count, and alarms that ring.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/whole_file.hpp"
#include "prove/baselines.hpp"
#include "prove/child.hpp"
#include "prove/leak.hpp"
#include "prove/score_proof.hpp"
#include "prove/seal.hpp"
#include "prove/tally.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::prove;
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// A proof of two short cases with a tool that says that nothing is left out.
class ProofFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / fmt::format("prove-test-{}", getpid());
    fs::remove_all(root_);
    fs::create_directories(root_);
    const fs::path tool = root_ / "tool";
    ASSERT_TRUE(
        core::write_whole_file(
            tool,
            "#!/bin/sh\nls > seen.txt\n"
            "printf '%s' '{\"schema\":1,\"verdict\":{\"kind\":\"nothing_left_out\",\"text\":"
            "\"\"},\"effects\":[],\"mismatch\":[]}' > verdict.json\n")
            .ok());
    fs::permissions(tool, fs::perms::owner_all);
    options_.out = root_ / "proof";
    options_.tool = tool;
    options_.cases = 2;
    options_.seed = 5;
    options_.duration_s = 20.0;
    options_.held_out_s = 10.0;
    options_.jobs = 1;
  }
  void TearDown() override { fs::remove_all(root_); }

  void whole() {
    const core::Status sealed = seal_cases(options_);
    ASSERT_TRUE(sealed.ok()) << sealed.error().message;
    const core::Status ran = run_cases(options_);
    ASSERT_TRUE(ran.ok()) << ran.error().message;
  }
  /// Replaces the first `from` in a file.
  void tamper(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = core::read_whole_file(file).value();
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << file;
    ASSERT_TRUE(core::write_whole_file(file, text.replace(at, from.size(), to)).ok());
  }
  [[nodiscard]] fs::path at(const char* name) const { return options_.out / name; }

  fs::path root_;
  ProofOptions options_;
};

TEST_F(ProofFolder, IsScoredWhereEveryHashFits) {
  whole();
  const auto proof = score_proof(options_, std::nullopt);
  ASSERT_TRUE(proof.ok()) << proof.error().message;
  EXPECT_EQ(proof.value()["cases"], 2);
  EXPECT_EQ(proof.value()["without_report"], 0);
  EXPECT_TRUE(fs::exists(at("proof.json")));
  EXPECT_TRUE(fs::exists(at("proof.html")));
}

TEST_F(ProofFolder, RefusesAVerdictThatWasChangedAfterItsSeal) {
  whole();
  tamper(at("verdicts/0001.json"), "nothing_left_out", "named");
  const auto opened = open_cases(options_.out);
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("verdicts/0001.json: was changed"), std::string::npos);
}

TEST_F(ProofFolder, RefusesACaseThatIsNotWhatWasCommittedTo) {
  whole();
  tamper(at("sealed/0000.json"), "\\\"kind\\\"", "\\\"kino\\\"");
  const auto opened = open_cases(options_.out);
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("committed"), std::string::npos);
}

TEST_F(ProofFolder, RefusesAnotherNonceAndAnotherRoot) {
  whole();
  const std::string seal = core::read_whole_file(at("seal.json")).value();
  const std::string root = Json::parse(seal)["merkle_root"];
  tamper(at("seal.json"), root, std::string(64, '0'));
  EXPECT_FALSE(open_cases(options_.out).ok());
  ASSERT_TRUE(core::write_whole_file(at("seal.json"), seal).ok());
  EXPECT_TRUE(open_cases(options_.out).ok());
  const std::string nonce =
      Json::parse(core::read_whole_file(at("sealed/0001.json")).value())["nonce"];
  tamper(at("sealed/0001.json"), nonce, fresh_nonce());
  EXPECT_FALSE(open_cases(options_.out).ok());
}

TEST_F(ProofFolder, GoesOnWhereItWasStopped) {
  int looks = 0;
  options_.look = [&looks](double, std::string_view) { return ++looks < 5; };
  EXPECT_FALSE(seal_cases(options_).ok());
  EXPECT_FALSE(fs::exists(at("seal.json")));
  options_.look = {};
  whole();
  const std::string first = core::read_whole_file(at("verdicts.json")).value();
  whole();  // nothing left to do
  EXPECT_EQ(core::read_whole_file(at("verdicts.json")).value(), first);
  options_.seed = 6;
  const core::Status other = seal_cases(options_);
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, core::ErrorCode::kUsage);
}

TEST_F(ProofFolder, RefusesAToolThatWasNotSealed) {
  ASSERT_TRUE(seal_cases(options_).ok());
  tamper(options_.tool, "#!/bin/sh\n", "#!/bin/sh\n# other\n");
  const core::Status ran = run_cases(options_);
  ASSERT_FALSE(ran.ok());
  EXPECT_NE(ran.error().message.find("another program"), std::string::npos);
}

TEST_F(ProofFolder, ShowsTheToolItsInputsAndNothingElse) {
  const fs::path given = root_ / "in.txt";
  ASSERT_TRUE(core::write_whole_file(given, "x").ok());
  ChildOptions child;
  child.command = {"/bin/sh", "-c", "ls -A > seen.txt; env > env.txt; pwd >> seen.txt"};
  child.given = {{given, "in.txt"}};
  child.wanted = {"seen.txt", "env.txt"};
  const auto result = run_child(child);
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result.value().files.size(), 2U);
  EXPECT_EQ(result.value().files[0].second.rfind("in.txt\nseen.txt\n", 0), 0U);
  EXPECT_EQ(result.value().files[0].second.find("prove-test"), std::string::npos);
  EXPECT_EQ(result.value().files[1].second.find("HOME"), std::string::npos);
}

TEST_F(ProofFolder, EndsAToolThatTakesTooLong) {
  ChildOptions child;
  child.command = {"/bin/sh", "-c", "sleep 60"};
  child.limit_s = 0.2;
  const auto result = run_child(child);
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result.value().timed_out);
  EXPECT_EQ(result.value().exit_code, -1);
}

TEST(ProveSeal, HashesAsPublished) {
  // FIPS 180-2, appendix B.1; RFC 6962's tree of one leaf is the leaf's hash.
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(merkle_root({}), sha256(""));
  EXPECT_EQ(merkle_root({"00"}), sha256(std::string("\0\0", 2)));
  EXPECT_NE(merkle_root({"00", "11"}), merkle_root({"11", "00"}));
  EXPECT_NE(merkle_root({"00", "11", "22"}), merkle_root({"00", "11", "22", "22"}));
  EXPECT_EQ(commitment("6162", "c"), sha256("abc"));
  EXPECT_NE(fresh_nonce(), fresh_nonce());
}

TEST(ProveStatistics, AgreesWithPublishedIntervals) {
  // Newcombe, Statist. Med. 1998, table I: 15 of 148 and 0 of 20.
  const auto [low, high] = wilson({15, 148});
  EXPECT_NEAR(low, 0.0624, 5e-4);
  EXPECT_NEAR(high, 0.1605, 5e-4);
  EXPECT_NEAR(wilson({0, 20}).second, 0.1611, 5e-4);
  EXPECT_NEAR(clopper_pearson_upper({15, 148}), 0.1617, 5e-4);
  EXPECT_NEAR(clopper_pearson_upper({0, 20}), 0.1684, 5e-4);
  EXPECT_EQ(median_of({3.0, 1.0, 2.0, 10.0}), 2.5);
  EXPECT_NEAR(interval_overlap({{0, 2}, {3, 4}}, {{1, 4}}), 2.0 / 4.0, 1e-12);
  EXPECT_EQ(interval_overlap({{0, 1}}, {}), 0.0);
}

TEST(ProveLeak, RingsWhereTheFormTellsAndStaysSilentWhereItDoesNot) {
  Random random(1, "leak");
  std::vector<std::vector<double>> noise, told;
  std::vector<int> labels;
  for (int i = 0; i < 120; ++i) {
    std::vector<double> row;
    for (int c = 0; c < 40; ++c) row.push_back(random.normal());
    labels.push_back(i % 2);
    noise.push_back(row);
    row[7] = static_cast<double>(i % 2) + 0.3 * random.normal();  // say, one more line in the plant
    told.push_back(row);
  }
  const auto [low, high] = wilson(classifier_hits(noise, labels));
  EXPECT_LE(low, 0.5);
  EXPECT_GE(high, 0.5);
  EXPECT_GT(wilson(classifier_hits(told, labels)).first, 0.6);
}

TEST(ProveBaselines, FindTheTermThatIsThere) {
  Random random(2, "baselines");
  TermLibrary library;
  library.y.resize(2000);
  library.nuisance.resize(2000, 0);
  for (const char* id : {"a", "b", "c"}) library.groups.push_back({id, Eigen::MatrixXd(2000, 1)});
  for (Eigen::Index i = 0; i < 2000; ++i) {
    for (auto& group : library.groups) group.columns(i, 0) = random.normal();
    library.y[i] = 0.5 * library.groups[1].columns(i, 0) + 0.1 * random.normal();
  }
  library.smallest = 0.1;
  EXPECT_EQ(stlsq(library), std::vector<std::size_t>{1});
  for (const auto& chosen : {bic_forward(library), lasso(library)}) {
    ASSERT_FALSE(chosen.empty());
    EXPECT_NE(std::find(chosen.begin(), chosen.end(), std::size_t{1}), chosen.end());
  }
}

Json manifest_of(const char* kind, const char* id, double over_floor) {
  Json subjects = Json::array();
  if (id != nullptr) {
    subjects.push_back({{"id", id},
                        {"joint", "elbow"},
                        {"joint_seen", "elbow"},
                        {"stage", "transmission"},
                        {"parameter", "ratio"},
                        {"value", 0.02},
                        {"amplitude", 0.02},
                        {"channel", "position"},
                        {"size_over_floor", over_floor},
                        {"testable", true}});
  }
  return {{"case", 0},
          {"kind", kind},
          {"subjects", subjects},
          {"parameter_off", nullptr},
          {"excited", true},
          {"floors", {{"elbow", {{"position", 1e-4}}}}}};
}

Json verdict_of(const char* kind, const char* id, double value,
                const std::vector<std::string>& others = {}) {
  Json effects = Json::array();
  if (id != nullptr) {
    effects.push_back({{"id", id},
                       {"joint", "elbow"},
                       {"stage", "transmission"},
                       {"ambiguous_with", others},
                       {"parameters",
                        {{{"name", "ratio"},
                          {"value", value},
                          {"unit", "1"},
                          {"ci95", {0.9 * value, 1.1 * value}}}}},
                       {"evidence", {{"held_out_before", 2.0}, {"held_out_after", 1.0}}}});
  }
  return {{"case", 0},
          {"wall_s", 1.0},
          {"report",
           {{"verdict", {{"kind", kind}, {"text", ""}}},
            {"effects", effects},
            {"mismatch", Json::array()},
            {"held_out",
             {{{"joint", "elbow"},
               {"metric", "position_rmse"},
               {"before", 1e-3},
               {"after", 1.4e-4},
               {"floor", 1e-4}}}}}}};
}

CaseScore scored(const Json& manifest, const Json& verdict) {
  auto score = score_case({0, manifest.dump(), verdict.dump()});
  EXPECT_TRUE(score.ok());
  return score.value();
}

TEST(ProveScore, CountsARightNameWithItsValue) {
  const CaseScore s =
      scored(manifest_of("single", "gain_error", 5.0), verdict_of("named", "gain_error", 0.021));
  EXPECT_TRUE(s.top1);
  EXPECT_TRUE(s.exact);
  EXPECT_NEAR(*s.subjects[0].parameter_error, 0.05, 1e-9);
  EXPECT_TRUE(*s.subjects[0].covered);
  EXPECT_NEAR(*s.subjects[0].removed, 1.0 - 0.96 / 99.0, 1e-9);
}

TEST(ProveScore, CountsANameInASetAndAWrongOne) {
  const CaseScore in_set = scored(manifest_of("single", "gain_error", 5.0),
                                  verdict_of("ambiguous", "creep", 0.1, {"gain_error"}));
  EXPECT_FALSE(in_set.top1);
  EXPECT_TRUE(in_set.subjects[0].in_a_set);
  EXPECT_EQ(in_set.set_size, 2);
  const CaseScore wrong =
      scored(manifest_of("single", "gain_error", 5.0), verdict_of("named", "creep", 0.1));
  EXPECT_FALSE(wrong.subjects[0].in_a_set);
  EXPECT_EQ(wrong.top1_id, "creep");
}

TEST(ProveScore, TellsAParameterOutOfToleranceFromPhysicsAndSilenceFromBoth) {
  Json verdict = verdict_of("parameter_out_of_tolerance", "gain_error", 0.1);
  EXPECT_EQ(scored(manifest_of("control", nullptr, 0.0), verdict).top1_id, "parameter");
  verdict["report"]["verdict"]["kind"] = "named";
  verdict["report"]["effects"][0]["out_of_tolerance"] = true;
  const CaseScore s = scored(manifest_of("control", nullptr, 0.0), verdict);
  EXPECT_TRUE(s.alarm);
  EXPECT_FALSE(s.physics);
  EXPECT_EQ(s.top1_id, "parameter");
  EXPECT_FALSE(
      scored(manifest_of("control", nullptr, 0.0), verdict_of("nothing_left_out", nullptr, 0))
          .alarm);
}

TEST(ProveScore, HoldsSilenceAgainstTheLimitOfTheSameNumber) {
  const auto kept = [](const char* parameter, double limit) {
    Json verdict = verdict_of("nothing_left_out", nullptr, 0.0);
    verdict["report"]["not_found"] = {{{"id", "gain_error"},
                                       {"joint", "elbow"},
                                       {"detection_limit", limit},
                                       {"parameter", parameter}}};
    return scored(manifest_of("single", "gain_error", 5.0), verdict).subjects[0].limit_kept;
  };
  EXPECT_EQ(kept("ratio", 0.03), true);
  EXPECT_EQ(kept("ratio", 0.01), false);
  EXPECT_EQ(kept("offset", 0.01), std::nullopt);
}

TEST(ProveScore, CountsACaseWithoutAReportAsNotNamed) {
  const CaseScore s = scored(manifest_of("single", "gain_error", 5.0),
                             {{"case", 0}, {"report", nullptr}, {"log", "crashed"}});
  EXPECT_TRUE(s.failed);
  EXPECT_FALSE(s.top1);
}

TEST(ProveScore, TakesACrashOnAControlForNoCleanBillOfHealth) {
  const CaseScore s = scored(manifest_of("control", nullptr, 0.0),
                             {{"case", 0}, {"report", nullptr}, {"log", "crashed"}});
  EXPECT_TRUE(s.alarm);
}

TEST(ProveScore, WantsTheUnknownFlaggedAtItsOwnJoint) {
  Json manifest = manifest_of("outside", "local_bump", 8.0);
  manifest["subjects"][0]["outside"] = true;
  Json verdict = verdict_of("unexplained", nullptr, 0);
  verdict["report"]["unexplained"] = {{{"joint", "shoulder"}, {"stage", "transmission"}}};
  EXPECT_FALSE(scored(manifest, verdict).subjects[0].flagged_here);
  verdict["report"]["unexplained"][0]["joint"] = "elbow";
  EXPECT_TRUE(scored(manifest, verdict).subjects[0].flagged_here);
}

TEST(ProveTally, CountsWhatIsOutsideOfTheVocabularyOnlyWhereNothingInsideImitatesIt) {
  Json manifest = manifest_of("outside", "square_viscous", 8.0);
  manifest["subjects"][0]["outside"] = true;
  manifest["subjects"][0]["own_over_floor"] = 0.8;
  manifest["subjects"][0]["imitated_by"] = "viscous_friction";
  Json own = manifest;
  own["subjects"][0]["own_over_floor"] = 5.0;
  const Json silent = verdict_of("nothing_left_out", nullptr, 0);
  EXPECT_EQ(tally({scored(manifest, silent)})["targets"][5]["verdict"], "no cases");
  EXPECT_EQ(tally({scored(own, silent)})["targets"][5]["verdict"], "not met");
}

TEST(ProveTally, MeetsItsTargetsWithAPerfectToolAndMissesThemWithAMuteOne) {
  std::vector<CaseScore> perfect, mute;
  for (int i = 0; i < 100; ++i) {
    perfect.push_back(
        scored(manifest_of("control", nullptr, 0.0), verdict_of("nothing_left_out", nullptr, 0)));
    perfect.push_back(scored(manifest_of("single", "gain_error", 5.0),
                             verdict_of("named", "gain_error", i < 95 ? 0.0201 : 0.05)));
    mute.push_back(scored(manifest_of("control", nullptr, 0.0), verdict_of("named", "creep", 1.0)));
    mute.push_back(scored(manifest_of("single", "gain_error", 5.0),
                          verdict_of("nothing_left_out", nullptr, 0)));
  }
  const auto verdict = [](const std::vector<CaseScore>& scores, std::size_t target) {
    return tally(scores)["targets"][target]["verdict"].get<std::string>();
  };
  EXPECT_EQ(verdict(perfect, 0), "met");       // false alarms
  EXPECT_EQ(verdict(perfect, 1), "met");       // strongest name
  EXPECT_EQ(verdict(perfect, 9), "met");       // coverage 95 of 100
  EXPECT_EQ(verdict(perfect, 3), "no cases");  // no pairs among them
  EXPECT_EQ(verdict(mute, 0), "not met");
  EXPECT_EQ(verdict(mute, 1), "not met");
  const std::string page = proof_html(tally(mute));
  EXPECT_NE(page.find("not met"), std::string::npos);
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.find(" src="), std::string::npos);
}

TEST(ProveTally, DoesNotCountControlsWithTenAlarmsOfAHundredAsFivePercent) {
  std::vector<CaseScore> scores;
  for (int i = 0; i < 100; ++i)
    scores.push_back(scored(manifest_of("control", nullptr, 0.0),
                            verdict_of(i < 2 ? "named" : "nothing_left_out", nullptr, 0)));
  // 2 of 100: the upper end is 7 %.
  EXPECT_EQ(tally(scores)["targets"][0]["verdict"], "not met");
  EXPECT_NEAR(tally(scores)["controls"]["any_finding_exact_upper"].get<double>(), 0.0704, 1e-3);
}

}  // namespace
