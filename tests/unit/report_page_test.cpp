// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "report/escape.hpp"
#include "report/page.hpp"
#include "report/report.hpp"
#include "report/tables.hpp"
#include "unit/report_sample.hpp"

namespace ravencal::report {
namespace {

namespace fs = std::filesystem;

class ReportFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("ravencal_report_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string content_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  fs::path folder_;
};

/// What stands between the tags of the chart data.
nlohmann::json charts_in(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"charts\">";
  const std::size_t begin = page.find(open) + open.size();
  return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

TEST(Escape, LeavesNoMarkupInText) {
  EXPECT_EQ(html_escape(R"(<a href="x" id='y'>&</a>)"),
            "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;&lt;/a&gt;");
}

TEST(Escape, JsonCannotCloseItsScriptAndReadsBackTheSame) {
  const nlohmann::json value = {{"text", "</script><!-- \\ \" é"}};
  const std::string text = script_json(value);
  EXPECT_EQ(text.find('<'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(text), value);
}

TEST(Escape, JsonSurvivesBytesThatAreNotUtf8) {
  EXPECT_TRUE(nlohmann::json::accept(script_json({{"text", "\xff\xfe"}})));
}

TEST(Template, DoesNotExpandPlaceholdersThatCameWithAValue) {
  EXPECT_EQ(fill_template("a {{x}} b {{y}}", {{"x", "{{y}}"}, {"y", "2"}}), "a {{y}} b 2");
}

TEST(Table, ShowsReductionsAndMarksWhatBecameWorse) {
  EXPECT_EQ(reduction_text(2.0, 0.5), "75.0 %");
  EXPECT_EQ(reduction_text(2.0, 2.5), "−25.0 %");
  EXPECT_EQ(reduction_text(0.0, 1.0), "–");
  EXPECT_EQ(reduction_text(1.0, kUnknown), "–");
  const ErrorTable table{"t", "", "", {{"elbow", "deg", 10, {2, 4}, {1, 2}, {3, 1}, {}}}};
  const std::string html = error_table_html(table);
  EXPECT_NE(html.find("class=\"group worse\">−50.0 %"), std::string::npos) << html;
  EXPECT_NE(html.find("75.0 %"), std::string::npos);
  EXPECT_EQ(html.find("published"), std::string::npos);
}

TEST(Table, KeepsThreeSignificantDigitsOfTheSmallestFigure) {
  EXPECT_EQ(decimals_for(0.0123), 4);
  EXPECT_EQ(decimals_for(1.23), 2);
  EXPECT_EQ(decimals_for(1230), 0);
  EXPECT_EQ(decimals_for(0.0), 3);
  EXPECT_EQ(figure_text(kUnknown, 2), "–");
}

TEST(Page, KeepsHostileTextAsText) {
  CalibrationReport report = sample_report(3000);
  const std::string hostile = "<script>alert(1)</script>";
  report.title = report.subtitle = report.verdict = report.reproduce = hostile;
  report.provenance = {{hostile, hostile}};
  report.tables[0].title = report.tables[0].note = report.tables[0].published_label = hostile;
  report.tables[0].rows[0].joint = report.tables[0].rows[0].unit = hostile;
  for (JointSeries& series : report.series) series.unit = hostile;
  report.series[0].joint = hostile;
  report.losses[0].name = report.loss_unit = hostile;
  report.real_time->conditions = hostile;
  const std::string page = page_of(report);
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(count_of(page, "</script>"), count_of(page_of(CalibrationReport{}), "</script>"));
}

TEST(Page, ForbidsEveryLoadAndNamesNoAddressToLoad) {
  const std::string page = page_of(sample_report(3000));
  EXPECT_NE(page.find("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none';"),
            std::string::npos);
  EXPECT_EQ(page.find("unsafe-eval"), std::string::npos);
  EXPECT_FALSE(
      std::regex_search(page.substr(0, page.find("<script")), std::regex("src=|@import|<link")));
  EXPECT_EQ(page.find("sourceMappingURL"), std::string::npos);
}

TEST(Page, GivesEveryChartItsPlace) {
  const std::string page = page_of(sample_report(30000));
  const nlohmann::json charts = charts_in(page);
  // Per joint: trace, two windows, histogram, quantiles, maps; then loss and two histograms.
  EXPECT_EQ(charts.size(), 3U * 6 + 1 + 2);
  for (const auto& chart : charts) {
    EXPECT_EQ(count_of(page, "id=\"" + chart["id"].get<std::string>() + "\""), 1U);
  }
  EXPECT_LT(page.size(), 3'000'000U);
}

TEST(Page, StaysSmallForAnHourOfThreeJoints) {
  EXPECT_LT(page_of(sample_report(360000)).size(), 3'000'000U);
}

TEST(Page, ShowsLongerWindowsOfASlowRecording) {
  CalibrationReport report = sample_report(3000);
  EXPECT_NE(page_of(report).find("Worst 10 s"), std::string::npos);
  for (JointSeries& series : report.series) {
    for (double& t_s : series.t_s) t_s *= 78;  // 0.78 s between samples
  }
  EXPECT_NE(page_of(report).find("Worst 160 s"), std::string::npos);
}

TEST(Page, LeavesOutWhatIsAbsent) {
  CalibrationReport report;
  report.title = "nothing yet";
  const std::string page = page_of(report);
  EXPECT_TRUE(charts_in(page).empty());
  EXPECT_EQ(page.find("<h2"), std::string::npos);
  EXPECT_EQ(page.find("<nav"), std::string::npos);
}

TEST(Page, DrawsASingleSampleAndASeriesOfGaps) {
  CalibrationReport report;
  report.series = {{"a", "deg", {0.0}, {1.0}, {1.5}, {1.0}, 0.0, {}},
                   {"b", "deg", {0.0, 0.1}, {kUnknown, kUnknown}, {1, 1}, {1, 1}, 0.0, {}}};
  EXPECT_EQ(charts_in(page_of(report)).size(), 6U);
}

TEST_F(ReportFile, IsWrittenWholeAndLeavesNothingBeside) {
  const fs::path path = folder_ / "report.html";
  ASSERT_TRUE(write_html(sample_report(3000), path).ok());
  const std::string page = content_of(path);
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
  EXPECT_TRUE(page.ends_with("</html>\n"));
  EXPECT_EQ(files(), 1U);
  ASSERT_TRUE(write_html(sample_report(3000), path).ok());
  EXPECT_EQ(content_of(path), page);
}

TEST_F(ReportFile, RefusesAFolderThatIsNotThere) {
  const fs::path path = folder_ / "missing" / "report.html";
  const core::Status status = write_html(sample_report(100), path);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kIo);
  EXPECT_NE(status.error().message.find(path.string()), std::string::npos)
      << status.error().message;
  EXPECT_NE(status.error().message.find("No such file"), std::string::npos)
      << status.error().message;
}

TEST_F(ReportFile, KeepsTheOldReportWhenTheDiskRefusesTheNewOne) {
  const fs::path path = folder_ / "report.html";
  std::ofstream(path) << "old";
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ,
              SIG_IGN);  // then a write beyond the limit fails with EFBIG, as a full disk does
  const rlimit tight{4096, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
  const core::Status status = write_html(sample_report(100), path);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kIo);
  EXPECT_EQ(content_of(path), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(ReportFile, RefusesVectorsThatDisagree) {
  CalibrationReport report = sample_report(100);
  report.series[1].raw.pop_back();
  const core::Status status = write_html(report, folder_ / "report.html");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kUsage);
  EXPECT_NE(status.error().message.find("'elbow' has 100 times but 99 values of raw"),
            std::string::npos)
      << status.error().message;
  EXPECT_EQ(files(), 0U);
}

TEST_F(ReportFile, RefusesAMapOverAJointThatIsNotThere) {
  CalibrationReport report = sample_report(100);
  report.map_x_joint = "wrist";
  const core::Status status = write_html(report, folder_ / "report.html");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("'wrist'"), std::string::npos) << status.error().message;
}

TEST_F(ReportFile, RefusesMapsOverSeriesOfUnequalLength) {
  CalibrationReport report = sample_report(100);
  report.series[0] = sample_report(50).series[0];
  EXPECT_FALSE(write_html(report, folder_ / "report.html").ok());
}

TEST_F(ReportFile, RefusesATimeThatIsNotANumber) {
  CalibrationReport report = sample_report(100);
  report.series[0].t_s[3] = kUnknown;
  const core::Status status = write_html(report, folder_ / "report.html");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("sample 3"), std::string::npos) << status.error().message;
}

}  // namespace
}  // namespace ravencal::report
