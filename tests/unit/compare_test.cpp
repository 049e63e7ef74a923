// SPDX-License-Identifier: Apache-2.0
#include "study/compare.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <utility>

#include "core/whole_file.hpp"
#include "learn/onnx_file.hpp"
#include "study/compare_evaluate.hpp"
#include "study/compare_tables.hpp"
#include "unit/browser.hpp"
#include "unit/learn/sample_arm.hpp"

namespace ravencal::study {
namespace {

namespace fs = std::filesystem;

/// Two methods on an arm whose error is linear in the torques, in a folder of the test's own.
class Compare : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.out =
        fs::temp_directory_path() /
        (std::string("compare_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(options_.out);
    options_.features = "elbow.torque,insertion.torque";
    options_.methods = {"raw", "bias", "linear"};
    options_.shares = {0.25};
    options_.title = "<b>Comparison</b>";
    data_.train = {&train_};
    data_.sets["test"] = {&test_};
  }
  void TearDown() override { fs::remove_all(options_.out); }

  Comparison run() {
    auto outcome = compare(data_, options_);
    EXPECT_TRUE(outcome.ok()) << (outcome.ok() ? "" : outcome.error().message);
    return outcome.ok() ? outcome->comparison : Comparison{};
  }

  record::Recording train_ = learn::sample_arm(2000, 1);
  record::Recording test_ = learn::sample_arm(1500, 2);
  CompareOptions options_;
  CompareData data_;
};

double rmse(const Comparison& c, std::size_t method, std::size_t joint) {
  return c.methods.at(method).joints.at(joint).sets.at("test").rmse;
}

TEST_F(Compare, GivesEveryMethodsErrorInDisplayUnits) {
  const Comparison c = run();
  ASSERT_EQ(c.methods.size(), 3U);
  // raw elbow error: 0.10 + 0.03 u, u uniform in [-1, 1]: rms of 0.1015 rad = 5.81 deg.
  EXPECT_NEAR(rmse(c, 0, 0), 5.81, 0.03);
  EXPECT_NEAR(rmse(c, 1, 0), 0.03 / std::sqrt(3.0) * 57.29578, 0.03);
  EXPECT_LT(rmse(c, 2, 0), 1e-4);
  EXPECT_EQ(c.methods[0].joints[1].unit, "mm");
  const CompareFigure& f = c.methods[1].joints[0].sets.at("test");
  EXPECT_LT(f.rmse_low, f.rmse);
  EXPECT_GT(f.rmse_high, f.rmse);
  EXPECT_LE(f.peak_high, f.peak + 1e-12);
  EXPECT_EQ(f.samples, 1500.0);
}

TEST_F(Compare, IntervalsTellMethodsApartOnlyWhereTheyDiffer) {
  options_.methods = {"bias", "linear", "ridge"};
  const Comparison c = run();
  const auto blocks = [&](std::size_t m) { return c.methods[m].joints[0].blocks; };
  const Ratio same = paired_ratio(blocks(0), blocks(0), 1);
  EXPECT_EQ(same.low, 1.0);
  EXPECT_EQ(same.high, 1.0);
  const Ratio better = paired_ratio(blocks(1), blocks(0), 1);
  EXPECT_LT(better.high, 0.01);
}

/// The file of a method's result; empty if there is none.
fs::path job_of(const fs::path& out, const std::string& id) {
  for (const auto& entry : fs::directory_iterator(out / "jobs")) {
    if (nlohmann::json::parse(core::read_whole_file(entry.path()).value()).at("id") == id)
      return entry.path();
  }
  return {};
}

TEST_F(Compare, GoesOnBehindWhatIsDone) {
  run();
  const fs::path file = job_of(options_.out, "linear");
  nlohmann::json kept = nlohmann::json::parse(core::read_whole_file(file).value());
  kept["training_s"] = 12345.0;  // would be overwritten by another run
  ASSERT_TRUE(core::write_whole_file(file, kept.dump()).ok());
  EXPECT_EQ(run().methods[2].training_s, 12345.0);
  const std::uint64_t first = std::exchange(options_.settings.seed, 4);
  EXPECT_LT(run().methods[2].training_s, 12345.0) << "another seed is another result";
  options_.settings.seed = first;
  EXPECT_EQ(run().methods[2].training_s, 12345.0) << "and the first is still there";
}

TEST_F(Compare, RefusesADamagedResultByName) {
  run();
  const fs::path file = job_of(options_.out, "bias");
  ASSERT_TRUE(core::write_whole_file(file, "{\"id\": 3").ok());
  const auto refused = compare(data_, options_);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
  EXPECT_NE(refused.error().message.find(file.string()), std::string::npos);
  fs::remove(file);
  EXPECT_NEAR(rmse(run(), 1, 0), 0.03 / std::sqrt(3.0) * 57.29578, 0.03);
}

TEST_F(Compare, KeepsFinishedMethodsWhenStopped) {
  options_.methods = {"raw", "bias", "network"};
  options_.look = [&](double, std::string_view what) { return what != "network"; };
  const auto outcome = compare(data_, options_);
  ASSERT_TRUE(outcome.ok());
  EXPECT_TRUE(outcome->interrupted);
  EXPECT_EQ(outcome->comparison.methods.size(), 2U);
  EXPECT_FALSE(job_of(options_.out, "bias").empty());
  EXPECT_TRUE(job_of(options_.out, "network").empty());
}

TEST_F(Compare, SameSeedSameErrors) {
  options_.methods = {"network"};
  options_.settings.hidden = {6};
  options_.settings.epochs = 3;
  const Comparison first = run();
  fs::remove_all(options_.out);
  EXPECT_EQ(rmse(first, 0, 0), rmse(run(), 0, 0));
}

TEST_F(Compare, FitsJointsApartWhoseTruthIsKnownAtDifferentTimes) {
  const auto truth = [](record::Recording& r, const char* name, Eigen::Index from) {
    const auto column = *r.column(record::Role::kJointTruth, name);
    r.samples.col(column).segment(from, r.rows() / 2).setConstant(std::nan(""));
  };
  truth(train_, "elbow", 0);
  truth(train_, "insertion", 1000);
  truth(test_, "elbow", 0);
  truth(test_, "insertion", 750);
  const Comparison c = run();
  EXPECT_LT(rmse(c, 2, 0), 1e-4);
  EXPECT_LT(rmse(c, 2, 1), 1e-4);
  EXPECT_EQ(c.methods[2].joints[0].sets.at("test").samples, 750.0);
}

TEST_F(Compare, ReportsAnotherLoadByItself) {
  record::Recording loaded = learn::sample_arm(800, 3, 0.5);  // a curvature that training never saw
  data_.sets["load"] = {&loaded};
  const Comparison c = run();
  const CompareJoint& elbow = c.methods[2].joints[0];
  EXPECT_GT(elbow.sets.at("load").rmse, 100.0 * elbow.sets.at("test").rmse);
  bool shown = false;
  for (const Table& table : comparison_tables(c)) shown = shown || table.id == "robustness";
  EXPECT_TRUE(shown);
}

TEST_F(Compare, NamesAMethodThatDoesNotExist) {
  options_.methods = {"magic"};
  const auto outcome = compare(data_, options_);
  ASSERT_FALSE(outcome.ok());
  EXPECT_EQ(outcome.error().code, core::ErrorCode::kUsage);
  EXPECT_NE(outcome.error().message.find("magic"), std::string::npos);
}

TEST_F(Compare, WritesAPageThatLoadsNothingAndWhatElseTheFolderHolds) {
  options_.methods = {"raw", "linear", "network", "lstm", "physics"};
  options_.settings.hidden = {4};
  options_.settings.epochs = 2;
  options_.settings.lstm_iterations = 2;
  const Comparison c = run();
  ASSERT_TRUE(write_comparison(c, options_.out).ok());
  const std::string html = core::read_whole_file(options_.out / "compare.html").value();
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
  for (const char* address : {" src=", "href=\"http", "url(http"})
    EXPECT_EQ(html.find(address), std::string::npos) << address;
  EXPECT_EQ(html.find("<b>Comparison"), std::string::npos);
  EXPECT_NE(html.find("&lt;b&gt;Comparison"), std::string::npos);
  EXPECT_NE(html.find("no diagnosis given"), std::string::npos) << "why physics has no figures";
  const auto back = read_comparison(options_.out / "compare.json");
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->methods.size(), c.methods.size());
  EXPECT_EQ(rmse(*back, 1, 0), rmse(c, 1, 0));
  EXPECT_EQ(back->methods.back().status, CompareStatus::kUnsuited);
  for (const char* file : {"compare.csv", "compare.md", "compare.tex"})
    EXPECT_GT(fs::file_size(options_.out / file), 200U) << file;
}

TEST_F(Compare, DrawsEveryFigureOfItsTables) {
  if (!test::has_browser()) GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  const Comparison c = run();
  ASSERT_TRUE(write_comparison(c, options_.out).ok());
  const auto opened = test::open_in_browser(options_.out / "compare.html", options_.out);
  EXPECT_EQ(opened.console, "");
  // Bars and maps of two joints.
  EXPECT_NE(opened.dom.find("data-charts-drawn=\"4/4\""), std::string::npos);
  EXPECT_NE(opened.dom.find("<h1>&lt;b&gt;Comparison&lt;/b&gt;</h1>"), std::string::npos);
  const std::string markdown = core::read_whole_file(options_.out / "compare.md").value();
  static const std::regex figure(R"(\d+\.\d+( to \d+\.\d+)?)");
  std::sregex_iterator at(markdown.begin(), markdown.end(), figure);
  EXPECT_GT(std::distance(at, std::sregex_iterator()), 30);
  for (; at != std::sregex_iterator(); ++at)
    EXPECT_NE(opened.dom.find(at->str()), std::string::npos) << at->str();
}

TEST_F(Compare, MapsEveryMethodOverThePlacesOfTheTest) {
  const Comparison c = run();
  const auto column = *test_.column(record::Role::kJointEstimate, "elbow");
  ASSERT_EQ(c.map.x.edges.size(), 13U);
  EXPECT_NEAR(c.map.x.edges.front(), 57.29578 * test_.samples.col(column).minCoeff(), 1e-3);
  EXPECT_NEAR(c.map.x.edges.back(), 57.29578 * test_.samples.col(column).maxCoeff(), 1e-3);
  EXPECT_EQ(c.map.y.unit, "mm");
  int cells = 0;
  for (std::size_t i = 0; i < 144; ++i) {
    const double raw = c.methods[0].maps.at(0).rmse.at(i);
    if (!std::isfinite(raw)) continue;
    ++cells;
    EXPECT_NEAR(raw, 5.81, 1.2);
    EXPECT_LT(c.methods[2].maps.at(0).rmse.at(i), 1e-4);
  }
  EXPECT_GT(cells, 100);
}

TEST_F(Compare, KeepsModelsThatConvertTakesAndSaysWhyOthersCannotBeLoaded) {
  options_.methods = {"linear", "polynomial"};
  const Comparison c = run();
  EXPECT_TRUE(c.methods[0].loop.loadable);
  EXPECT_TRUE(fs::exists(options_.out / c.methods[0].model_file)) << c.methods[0].model_file;
  EXPECT_FALSE(c.methods[1].loop.loadable);
  EXPECT_FALSE(c.methods[1].loop.why_not.empty());
  EXPECT_GT(c.methods[1].own_step.p999_us, 0.0);
}

/// As `simulate` writes it.
std::map<std::string, std::string> meta_of_seeds(int run, int homing) {
  return {{"plant_hash", "00ff"},
          {"seed", std::to_string(run)},
          {"homing_seed", std::to_string(homing)}};
}

TEST_F(Compare, RefusesATestThatSharesARunSeedWithTheTraining) {
  train_.meta = meta_of_seeds(2, 1);
  test_.meta = meta_of_seeds(3, 2);
  record::Recording loaded = test_;
  loaded.source = "loaded.db";
  loaded.meta = meta_of_seeds(2, 3);
  data_.sets["load"] = {&loaded};
  const auto refused = compare(data_, options_);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
  EXPECT_NE(refused.error().message.find("loaded.db: has the run seed 2 of sample.db"),
            std::string::npos)
      << refused.error().message;
  EXPECT_FALSE(fs::exists(options_.out)) << "before any method is fitted";

  options_.same_seed = true;
  test_.meta = meta_of_seeds(3, 1);
  const Comparison c = run();
  ASSERT_TRUE(write_comparison(c, options_.out).ok());
  const auto json =
      nlohmann::json::parse(core::read_whole_file(options_.out / "compare.json").value());
  ASSERT_EQ(json["same_seed"].size(), 1U);
  EXPECT_EQ(json["same_seed"][0]["tested"], "loaded.db");
  EXPECT_EQ(json["same_seed"][0]["seed"], 2);
  ASSERT_EQ(json["one_homing"].size(), 1U);
  EXPECT_EQ(json["one_homing"][0]["tested"], "sample.db");
  const std::string table = core::read_whole_file(options_.out / "compare.md").value();
  for (const char* words : {"same seed: loaded.db", "one homing: sample.db"})
    EXPECT_NE(table.find(words), std::string::npos) << table;
}

TEST_F(Compare, ItsModelsKeepTheSeedsOfTheirTraining) {
  train_.meta = meta_of_seeds(2, 1);
  options_.methods = {"linear"};
  const Comparison c = run();
  const auto model = learn::read_onnx(options_.out / c.methods[0].model_file);
  ASSERT_TRUE(model.ok()) << model.error().message;
  ASSERT_EQ(model->seeds.size(), 1U);
  EXPECT_EQ(model->seeds[0].run, 2U);
}

}  // namespace
}  // namespace ravencal::study
