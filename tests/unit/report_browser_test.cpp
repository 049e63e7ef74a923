// SPDX-License-Identifier: Apache-2.0
//
// Opens reports in headless Chromium, as a user would, and looks at what it drew.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "report/report.hpp"
#include "unit/browser.hpp"
#include "unit/report_sample.hpp"

namespace ravencal::report {
namespace {

namespace fs = std::filesystem;

using test::Opened;

class ReportInBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_browser()) {
      GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
    }
    folder_ = fs::temp_directory_path() / ("ravencal_browser_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }

  [[nodiscard]] Opened open(const fs::path& page) const {
    return test::open_in_browser(page, folder_);
  }

  [[nodiscard]] Opened open(const CalibrationReport& report) const {
    const fs::path page = folder_ / "report.html";
    const core::Status status = write_html(report, page);
    if (!status.ok()) {
      ADD_FAILURE() << status.error().message;
      return {};
    }
    return open(page);
  }

  fs::path folder_;
};

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

/// The elements of chart `index`: from its container to the caption behind it.
std::string chart_in(const std::string& dom, std::size_t index) {
  const std::size_t begin = dom.find("id=\"chart-" + std::to_string(index) + "\"");
  if (begin == std::string::npos) return "";
  return dom.substr(begin, dom.find("<figcaption", begin) - begin);
}

/// Marks of that kind that have a shape: paths that go somewhere ("M0,0" alone is a point of no
/// size).
std::size_t drawn_paths(const std::string& chart, const std::string& kind) {
  constexpr std::size_t kShortestShape = 5;
  std::size_t paths = 0;
  const std::string open = "class=\"mark-" + kind + " role-mark";
  for (std::size_t at = chart.find(open); at != std::string::npos; at = chart.find(open, at + 1)) {
    const std::size_t end = chart.find("</g>", at);
    for (std::size_t d = chart.find(" d=\"", at); d < end; d = chart.find(" d=\"", d + 1)) {
      if (chart.find('"', d + 4) - (d + 4) >= kShortestShape) ++paths;
    }
  }
  return paths;
}

/// Charts that page.js replaced by the reason why they are missing.
std::size_t failed_charts(const std::string& dom) {
  return count_of(dom, "\">This chart could not be drawn: ");
}

TEST_F(ReportInBrowser, DrawsEveryChartWithoutAnError) {
  const Opened opened = open(sample_report(6000));
  ASSERT_TRUE(opened.ok);
  EXPECT_EQ(opened.console, "");
  EXPECT_NE(opened.dom.find("data-charts-drawn=\"21/21\""), std::string::npos);
  EXPECT_EQ(failed_charts(opened.dom), 0U);
  for (std::size_t joint = 0; joint < 3; ++joint) {
    const std::size_t first = 6 * joint;
    EXPECT_EQ(drawn_paths(chart_in(opened.dom, first), "line"), 5U) << "trace of joint " << joint;
    EXPECT_EQ(drawn_paths(chart_in(opened.dom, first + 1), "line"), 6U) << "typical window";
    EXPECT_EQ(drawn_paths(chart_in(opened.dom, first + 2), "line"), 6U) << "worst window";
    EXPECT_EQ(drawn_paths(chart_in(opened.dom, first + 3), "line"), 3U) << "histogram";
    EXPECT_EQ(drawn_paths(chart_in(opened.dom, first + 4), "line"), 3U) << "quantiles";
    EXPECT_GT(drawn_paths(chart_in(opened.dom, first + 5), "rect"), 100U) << "maps";
  }
  EXPECT_EQ(drawn_paths(chart_in(opened.dom, 18), "line"), 2U) << "loss";
  EXPECT_EQ(drawn_paths(chart_in(opened.dom, 18), "symbol"), 1U) << "kept epoch";
  EXPECT_EQ(drawn_paths(chart_in(opened.dom, 19), "rect"), 3U) << "wake-up";
  EXPECT_EQ(drawn_paths(chart_in(opened.dom, 20), "rect"), 2U) << "step";
}

TEST_F(ReportInBrowser, RunsNothingThatATitleBrings) {
  CalibrationReport report = sample_report(6000);
  report.title = "</title><script>document.title='taken'</script>";
  report.series[0].joint = "</script><script>document.title='taken'</script>";
  report.series[0].unit = "d'e\\g\"";
  const Opened opened = open(report);
  ASSERT_TRUE(opened.ok);
  EXPECT_EQ(opened.console, "");
  EXPECT_NE(opened.dom.find("data-charts-drawn=\"21/21\""), std::string::npos);
  EXPECT_EQ(count_of(opened.dom, "<title>taken"), 0U);
  EXPECT_EQ(failed_charts(opened.dom), 0U);
}

TEST_F(ReportInBrowser, DrawsASingleSampleAndASeriesOfGaps) {
  CalibrationReport report;
  report.title = "almost nothing";
  report.series = {{"a", "deg", {0.0}, {1.0}, {1.5}, {1.0}, 0.0, {}},
                   {"b", "deg", {0.0, 0.1}, {kUnknown, kUnknown}, {1, 1}, {1, 1}, 0.0, {}}};
  report.losses = {{"diverged", {kUnknown, 0.0}, {}, 1}};
  const Opened opened = open(report);
  ASSERT_TRUE(opened.ok);
  EXPECT_EQ(opened.console, "");
  EXPECT_NE(opened.dom.find("data-charts-drawn=\"7/7\""), std::string::npos);
}

TEST_F(ReportInBrowser, RingsWhenAScriptFails) {
  // Check of the test: it must see a page that is broken on purpose as broken.
  const fs::path page = folder_ / "report.html";
  ASSERT_TRUE(write_html(sample_report(3000), page).ok());
  std::ifstream file(page, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string wanted = "isValid(";
  text.replace(text.find(wanted), wanted.size(), "isWrong(");
  text.replace(text.rfind("draw_charts();"), 14, "draw_charts(); no_such_function();");
  std::ofstream(page, std::ios::binary) << text;
  const Opened opened = open(page);
  ASSERT_TRUE(opened.ok);
  EXPECT_NE(opened.console.find("no_such_function"), std::string::npos) << opened.console;
  EXPECT_EQ(failed_charts(opened.dom), 1U);
}

TEST_F(ReportInBrowser, IsHeldToItsPromiseToLoadNothing) {
  // The policy must stop a load that a later change might sneak in.
  const fs::path page = folder_ / "report.html";
  ASSERT_TRUE(write_html(sample_report(3000), page).ok());
  std::ofstream(folder_ / "beside.js") << "document.title = 'loaded';";
  std::ifstream file(page, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  text.replace(text.rfind("</body>"), 7, "<script src=\"beside.js\"></script></body>");
  std::ofstream(page, std::ios::binary) << text;
  const Opened opened = open(page);
  ASSERT_TRUE(opened.ok);
  EXPECT_NE(opened.console.find("Content Security Policy"), std::string::npos) << opened.console;
  EXPECT_EQ(count_of(opened.dom, "<title>loaded"), 0U);
}

}  // namespace
}  // namespace ravencal::report
