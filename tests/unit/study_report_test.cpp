// SPDX-License-Identifier: Apache-2.0
//
// Study charts in headless Chromium: every chart is drawn, nothing is loaded from elsewhere.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "core/whole_file.hpp"
#include "report/study_charts.hpp"
#include "report/study_page.hpp"
#include "unit/run_command.hpp"
#include "unit/study_arm.hpp"

namespace ravencal::report {
namespace {

namespace fs = std::filesystem;

StudyPage sample_page() {
  StudyPage page;
  page.title = "A <study>";
  page.verdict = "5 of 6 hold.";
  const double none = std::nan("");
  const BarPanel bars{"shoulder",
                      "deg",
                      0.25,
                      {{0.25, 0.2, 0.3, false}, {9.0, 8.0, 10.0, true}, {none, none, none, false}}};
  const SettingLine line{"all features", {0.2, 5.0, 6.0}, {0.1, 4.0, 5.0}, {0.3, 6.0, 7.0}};
  const SettingLine other{"no encoder", {0.2, 0.2, 0.2}, {0.1, 0.1, none}, {0.3, 0.3, none}};
  MapGrid grid;
  grid.columns = grid.rows = 2;
  const std::vector<MapCell> cells = {{100, 0.1, 0}, {100, 0.2, 0}, {3, 0.3, 0}, {0, none, 0}};
  page.sections = {
      {"one",
       "One",
       "<p>table</p>",
       {{"bars", "c", bar_chart("bars", {"no ablation", "torque", "lost"}, {bars, bars})}}},
      {"two",
       "Two",
       "",
       {{"homing", "c", setting_chart("homing", "homings", {{"elbow", "deg", {line, other}}})},
        {"map", "c",
         workspace_chart("map", grid, "x [deg]", "y [deg]", "mm",
                         {{"raw", 0, cells}, {"none", 1, cells}})}}}};
  page.provenance = {{"seed", "3"}};
  return page;
}

TEST(StudyPage, IsOneFileThatLoadsNothing) {
  const study::StudyFolder folder;
  const fs::path path = folder.path() / "page.html";
  ASSERT_TRUE(write_study_html(sample_page(), path).ok());
  const auto html = core::read_whole_file(path);
  ASSERT_TRUE(html.ok());
  EXPECT_NE(html->find("A &lt;study&gt;"), std::string::npos);
  EXPECT_EQ(html->find("src=\"http"), std::string::npos);
  EXPECT_NE(html->find("default-src 'none'"), std::string::npos);
  EXPECT_FALSE(write_study_html(sample_page(), folder.path() / "none" / "page.html").ok());
}

TEST(StudyPage, DrawsEveryChartInABrowserWithoutAnError) {
  if (test::run_command("command -v chromium").exit_code != 0) {
    GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  }
  const study::StudyFolder folder;
  const fs::path path = folder.path() / "page.html";
  ASSERT_TRUE(write_study_html(sample_page(), path).ok());
  const auto opened = test::run_command(
      "timeout 1800 chromium --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
      "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
      "--virtual-time-budget=60000 --user-data-dir='" +
      (folder.path() / "profile").string() + "' --dump-dom 'file://" + path.string() +
      "' 2>/dev/null");
  ASSERT_EQ(opened.exit_code, 0);
  EXPECT_NE(opened.text.find("data-charts-drawn=\"3/3\""), std::string::npos);
  EXPECT_EQ(opened.text.find("\">This chart could not be drawn: "), std::string::npos);
}

}  // namespace
}  // namespace ravencal::report
