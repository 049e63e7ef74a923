// SPDX-License-Identifier: Apache-2.0
//
// A proof of both worlds says which made each case and shows their figures side by side; and its
// parts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/whole_file.hpp"
#include "prove/score_proof.hpp"
#include "prove/worlds.hpp"
#include "unit/browser.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::prove;

/// Four short cases and a tool that says that nothing is left out.
class WorldsFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = std::filesystem::temp_directory_path() / fmt::format("prove-worlds-{}", getpid());
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(root_);
    options_.out = root_ / "proof";
    options_.tool = root_ / "tool";
    options_.cases = 4;
    options_.seed = 5;
    options_.duration_s = 20.0;
    options_.held_out_s = 10.0;
    options_.jobs = 1;
    ASSERT_TRUE(core::write_whole_file(
                    options_.tool,
                    "#!/bin/sh\nprintf '%s' '{\"schema\":1,\"verdict\":{\"kind\":"
                    "\"nothing_left_out\",\"text\":\"\"},\"effects\":[],\"mismatch\":[]}' "
                    "> verdict.json\n")
                    .ok());
    std::filesystem::permissions(options_.tool, std::filesystem::perms::owner_all);
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  nlohmann::ordered_json proof_of(WorldChoice world) {
    options_.world = world;
    EXPECT_TRUE(seal_cases(options_).ok());
    EXPECT_TRUE(run_cases(options_).ok());
    auto proof = score_proof(options_, std::nullopt);
    EXPECT_TRUE(proof.ok()) << (proof.ok() ? "" : proof.error().message);
    return std::move(proof).value();
  }

  std::filesystem::path root_;
  ProofOptions options_;
};

TEST_F(WorldsFolder, BothAreShownSideBySide) {
  const auto proof = proof_of(WorldChoice::kBoth);
  ASSERT_TRUE(proof.contains("worlds"));
  EXPECT_EQ(proof["worlds"]["own"]["cases"], 2);
  EXPECT_EQ(proof["worlds"]["other"]["cases"], 2);
  EXPECT_EQ(proof["worlds"]["own"]["targets"].size(), proof["targets"].size());
  for (const auto& item : proof["case_list"])
    EXPECT_EQ(item["world"], item["case"].get<int>() % 2 == 0 ? "own" : "other");
  const auto opened = open_cases(options_.out);
  ASSERT_TRUE(opened.ok());
  EXPECT_EQ(nlohmann::json::parse(opened.value()[1].manifest)["world"], "other");
  const std::string text = worlds_text(proof);
  EXPECT_NE(text.find("    own "), std::string::npos) << text;
  EXPECT_NE(text.find("    other "), std::string::npos) << text;
}

TEST_F(WorldsFolder, ThePageShowsBothDrawsWithoutAnErrorAndKeepsNamesAsText) {
  if (!test::has_browser()) GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  auto proof = proof_of(WorldChoice::kBoth);
  proof["case_list"][0]["robot"] = "</script><script>document.title='taken'</script>";
  const std::filesystem::path page = root_ / "page.html";
  ASSERT_TRUE(core::write_whole_file(page, proof_html(proof)).ok());
  const test::Opened opened = test::open_in_browser(page, root_);
  ASSERT_TRUE(opened.ok);
  EXPECT_EQ(opened.console, "");
  EXPECT_NE(opened.dom.find("data-charts-drawn=\"1/1\""), std::string::npos);
  EXPECT_NE(opened.dom.find("<h2 id=\"worlds\">By world</h2>"), std::string::npos);
  EXPECT_EQ(opened.dom.find("<title>taken"), std::string::npos);
}

TEST_F(WorldsFolder, PartsDiagnoseTheirOwnCasesAndTheLastOneSealsTheVerdicts) {
  ASSERT_TRUE(seal_cases(options_).ok());
  options_.parts = 3;
  for (const int part : {2, 3, 1}) {
    EXPECT_FALSE(std::filesystem::exists(options_.out / "verdicts.json")) << part;
    options_.part = part;
    ASSERT_TRUE(run_cases(options_).ok());
    if (part == 2) {
      EXPECT_TRUE(std::filesystem::exists(options_.out / "verdicts/0001.json"));
      EXPECT_EQ(missing_verdicts(options_), 3);
    }
  }
  EXPECT_TRUE(open_cases(options_.out).ok());
}

TEST_F(WorldsFolder, AloneIsNotComparedAndAProofWithoutTheKeyIsOfTheOwnOne) {
  const auto proof = proof_of(WorldChoice::kOwn);
  EXPECT_FALSE(proof.contains("worlds"));
  EXPECT_EQ(worlds_text(proof), "");
  EXPECT_EQ(core::read_whole_file(options_.out / "prove.json")->find("world"), std::string::npos);
  options_.world = WorldChoice::kOther;
  const core::Status other = seal_cases(options_);
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, core::ErrorCode::kUsage);
}

}  // namespace
