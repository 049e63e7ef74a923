// SPDX-License-Identifier: Apache-2.0
//
// The second half of diagnose: free run, servo law, combinations, another simulator's baseline,
// predictions for training, the page.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "diagnose_generator.hpp"
#include "unit/browser.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;
using generator::HiddenPhysics;
using generator::Scene;

/// A plant in a file, as users have it.
physics::Plant plant_file(const std::string& text, const std::string& name) {
  const std::string path = ::testing::TempDir() + "diagnose_show_" + name + ".toml";
  std::ofstream(path) << text;
  auto plant = physics::load_plant(path);
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

const diagnose::NamedEffect* find(const diagnose::Report& report, const std::string& id) {
  for (const auto& e : report.effects) {
    if (e.id == id) return &e;
  }
  return nullptr;
}

const diagnose::HeldOut* figure(const diagnose::Report& report, const std::string& metric) {
  for (const auto& h : report.held_out) {
    if (h.metric == metric) return &h;
  }
  return nullptr;
}

TEST(Diagnose, WritesBackWhatTheFreeRunFoundAndThePlantRunsBetter) {
  HiddenPhysics hidden;
  hidden.coulomb_n_m = 1.5;
  hidden.viscous_n_m_s = 3.0;
  Scene scene;
  scene.rate_hz = 100.0;
  scene.duration_s = 200.0;
  Scene other = scene;
  other.seed = 7;
  const physics::Plant plant = plant_file(generator::plant_text(), "bare");
  diagnose::Options options;
  options.threads = 1;
  const auto report =
      diagnose::diagnose({generator::make_recording(hidden, scene)},
                         {generator::make_recording(hidden, other)}, plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const auto* row = figure(*report, "free_run_1s_rmse");
  ASSERT_NE(row, nullptr);
  EXPECT_LT(row->after, 0.5 * row->before);
  const auto improved = physics::parse_plant(diagnose::improved_text(*report), "improved");
  ASSERT_TRUE(improved.ok()) << improved.error().message;
  const auto* coulomb = find(*report, "coulomb_friction");
  ASSERT_NE(coulomb, nullptr) << report->verdict.text;
  EXPECT_DOUBLE_EQ(improved->joints.front().parameter("coulomb_friction", "level"),
                   coulomb->parameters.front().value);
  EXPECT_LE(coulomb->parameters.front().ci95.first, coulomb->parameters.front().value);
  EXPECT_GE(coulomb->parameters.front().ci95.second, coulomb->parameters.front().value);
}

/// Plants come from text as well, and files move after they were read.
TEST(Diagnose, NeedsNoFileOfThePlant) {
  HiddenPhysics hidden;
  hidden.coulomb_n_m = 1.5;
  Scene scene;
  scene.rate_hz = 100.0;
  scene.duration_s = 120.0;
  const physics::Plant kept = plant_file(generator::plant_text(), "kept");
  const physics::Plant moved = plant_file(generator::plant_text(), "moved");
  ASSERT_TRUE(std::filesystem::remove(moved.source));
  const auto diagnosed = [&](const physics::Plant& plant) {
    diagnose::Options options;
    options.threads = 1;
    return diagnose::diagnose({generator::make_recording(hidden, scene)}, {}, plant, options);
  };
  const auto with_file = diagnosed(kept);
  ASSERT_TRUE(with_file.ok()) << with_file.error().message;
  ASSERT_NE(figure(*with_file, "free_run_1s_rmse"), nullptr);
  const auto without = diagnosed(moved);
  ASSERT_TRUE(without.ok()) << without.error().message;
  EXPECT_EQ(diagnose::report_json(*without), diagnose::report_json(*with_file));
  EXPECT_EQ(diagnose::improved_text(*without), diagnose::improved_text(*with_file));
}

TEST(Diagnose, MeasuresAgainstAnotherSimulatorThatCountsItsTimeFromZero) {
  HiddenPhysics hidden;
  hidden.gap_half_rad = 0.01;
  const record::Recording real = generator::make_recording(hidden, {});
  // The simulator knows all but the gap, has no noise of its own and another clock. Without load a
  // gap and a yielding cable make the same loop.
  Scene quiet;
  quiet.noise = 0.0;
  record::Recording simulated = generator::make_recording({}, quiet);
  for (std::int64_t& t : simulated.t_ns) t += 3'600'000'000'000;
  const physics::Plant plant = plant_file(generator::plant_text(), "simulated");
  diagnose::Options options;
  options.threads = 1;
  options.simulated = {simulated};
  const auto report = diagnose::diagnose({real}, {}, plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const bool named = std::any_of(report->effects.begin(), report->effects.end(), [](const auto& e) {
    return e.id == "backlash" || e.id == "hysteresis" ||
           std::find(e.ambiguous_with.begin(), e.ambiguous_with.end(), "backlash") !=
               e.ambiguous_with.end();
  });
  EXPECT_TRUE(named) << report->verdict.text;
}

TEST(Diagnose, FindsNothingWhereTheOtherSimulatorHasTheEffect) {
  HiddenPhysics hidden;
  hidden.gap_half_rad = 0.01;
  Scene quiet;
  quiet.noise = 0.0;
  const physics::Plant plant = plant_file(generator::plant_text(), "simulated");
  diagnose::Options options;
  options.threads = 1;
  options.simulated = {generator::make_recording(hidden, quiet)};
  const auto report =
      diagnose::diagnose({generator::make_recording(hidden, {})}, {}, plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(find(*report, "backlash"), nullptr) << report->verdict.text;
}

TEST(Diagnose, RefusesASimulationOfAnotherLength) {
  Scene brief;
  brief.duration_s = 40.0;
  const physics::Plant plant = plant_file(generator::plant_text(), "simulated");
  diagnose::Options options;
  options.simulated = {generator::make_recording({}, brief)};
  const auto report = diagnose::diagnose({generator::make_recording({}, {})}, {}, plant, options);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("covers"), std::string::npos) << report.error().message;
}

TEST(Report, IsNotMadeWhereItsReaderStopsAmongTheTwins) {
  const physics::Plant plant = plant_file(generator::plant_text(), "page");
  diagnose::Options options;
  options.threads = 1;
  options.placebos = 2;
  double last = 0.0;
  options.look = [&last](double done, std::string_view what) {
    EXPECT_GE(done, last);
    EXPECT_LE(done, 1.0);
    last = done;
    return what != "placebo recordings";
  };
  const auto report = diagnose::diagnose({generator::make_recording({}, {})}, {}, plant, options);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("stopped before"), std::string::npos)
      << report.error().message;
  EXPECT_GT(last, 0.0);
}

void expect_every_part(const std::string& page) {
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos) << "the page may load nothing";
  if (!test::has_browser()) GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  const std::filesystem::path folder = ::testing::TempDir() + "diagnose_show_browser";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "report.html") << page;
  const test::Opened opened = test::open_in_browser(folder / "report.html", folder);
  std::filesystem::remove_all(folder);
  EXPECT_EQ(opened.console, "");
  for (const char* part :
       {"Causes", "What to record next", "What was looked at", "Error on motion that no fit saw",
        "Error as the model grows, on motion that no fit saw", "Error over position and speed",
        "Size of ", "Every figure on motion that no fit saw", "Candidates and their gates",
        "would have been found from", "Not testable with these recordings"}) {
    EXPECT_NE(opened.dom.find(std::string(">") + part), std::string::npos) << part;
  }
  EXPECT_NE(opened.dom.find("Placebo recordings have the motion of this one"), std::string::npos);
}

TEST(Report, ShowsEveryPartOfThePageAndNeedsNoOtherFile) {
  HiddenPhysics hidden;
  hidden.gap_half_rad = 0.01;
  const physics::Plant plant = plant_file(generator::plant_text(), "page");
  diagnose::Options options;
  options.threads = 1;
  options.placebos = 2;
  options.held_out_from_s = 250.0;
  const auto report =
      diagnose::diagnose({generator::make_recording(hidden, {})}, {}, plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const std::string json = diagnose::report_json(*report);
  EXPECT_NE(json.find("\"out_of_tolerance\": false"), std::string::npos);
  EXPECT_NE(json.find("\"known_together\""), std::string::npos);
  ASSERT_FALSE(report->held_out.empty());
  const auto at =
      std::find_if(report->held_out.begin(), report->held_out.end(),
                   [](const diagnose::HeldOut& h) { return h.metric == "position_rmse"; });
  ASSERT_NE(at, report->held_out.end());
  const diagnose::HeldOut& first = *at;
  ASSERT_TRUE(first.change_ci95.has_value());
  EXPECT_LT(first.change_ci95->first, first.change());
  EXPECT_GT(first.change_ci95->second, first.change());
  ASSERT_EQ(first.by_recording.size(), 1U);
  EXPECT_DOUBLE_EQ(first.by_recording.front().after, first.after);
  ASSERT_FALSE(report->looked_at.empty());
  EXPECT_GT(report->looked_at.front().band_hz.second, report->looked_at.front().band_hz.first);
  expect_every_part(diagnose::report_html(*report));
}

}  // namespace
