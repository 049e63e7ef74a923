// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "core/whole_file.hpp"
#include "report/document.hpp"
#include "study/table.hpp"
#include "unit/browser.hpp"

namespace {

using namespace ravencal::study;

Table sample() {
  Table table;
  table.id = "removal";
  table.title = "Removal & \"more\" <b>";
  table.row_title = "without";
  table.note = "Bold: more than 30 % worse.";
  table.theirs_label = "theirs: arXiv, robot";
  table.columns = {{"joint 1", "deg", "unloaded", -1},
                   {"joint 2", "deg", "unloaded", -1},
                   {"joint 1", "deg", "500 g", 1},
                   {"fits", "", "", -1}};
  Cell full;
  full.mean = 0.26812;
  full.deviation = 0.0041;
  full.low = 0.25;
  full.high = 0.29;
  full.theirs = 0.3003;
  Cell worse;
  worse.mean = 12.5;
  worse.mark = Mark::kWorse;
  Cell text;
  text.text = "yes, a|b";
  table.rows = {{"nothing", {full, worse, worse, text}, false},
                {"joint_pose", {Cell{}, full, full, Cell{}}, true}};
  return table;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(StudyTable, PageShowsFigureSpreadIntervalTheirsAndMarkAndUsersTextAsText) {
  namespace fs = std::filesystem;
  if (!ravencal::test::has_browser())
    GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  const fs::path folder =
      fs::temp_directory_path() / ("ravencal_table_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string page = ravencal::report::drawn_html(
      "", table_json(sample()).dump(), "",
      "const data = JSON.parse(document.getElementById('data').textContent);"
      "document.querySelector('main').append(...study_table(data));");
  ASSERT_TRUE(ravencal::core::write_whole_file(folder / "page.html", page).ok());
  const auto opened = ravencal::test::open_in_browser(folder / "page.html", folder);
  fs::remove_all(folder);
  EXPECT_EQ(opened.console, "");
  for (const char* shown :
       {"<th scope=\"row\">nothing</th><td class=\"group\">0.268\u2009±\u20090.004<br>",
        "<small class=\"note\">0.250 to 0.290</small>", "<small class=\"note\">(0.300)</small>",
        "<td class=\"group worse\">12.5</td>", "<td class=\"group\">yes, a|b</td>",
        "<td class=\"group\">–</td>", "<tr class=\"ruled\"><th scope=\"row\">joint_pose</th>",
        "class=\"group\" scope=\"colgroup\" colspan=\"2\">unloaded<", "joint 2 [deg]</th>",
        "<caption>Removal &amp; \"more\" &lt;b&gt;</caption>", ">Bold: more than 30 % worse.</p>",
        ">In parentheses, theirs: arXiv, robot.</p>"})
    EXPECT_NE(opened.dom.find(shown), std::string::npos) << shown << "\n" << opened.dom;
}

TEST(StudyTable, MarkdownHasOneLinePerRowAndAsManyBarsInEach) {
  const std::string markdown = to_markdown(sample());
  EXPECT_NE(markdown.find("| nothing | 0.268 ± 0.004 [0.250 to 0.290] (0.300) | **12.500** |"),
            std::string::npos)
      << markdown;
  EXPECT_NE(markdown.find("500 g: joint 1 [deg]"), std::string::npos) << markdown;
  EXPECT_NE(markdown.find("yes, a\\|b"), std::string::npos) << markdown;
  // 4 lines of 6 bars, and the escaped one.
  EXPECT_EQ(count(markdown, "|"), 4U * 6U + 1U) << markdown;
}

TEST(StudyTable, LatexIsTheBooktabsFormWithEscapedText) {
  const std::string latex = to_latex(sample());
  EXPECT_NE(latex.find("Removal \\& \"more\""), std::string::npos) << latex;
  EXPECT_NE(latex.find("joint\\_pose & --"), std::string::npos) << latex;
  EXPECT_NE(latex.find("\\multicolumn{2}{c}{unloaded} & \\multicolumn{1}{c}{500 g}"),
            std::string::npos)
      << latex;
  EXPECT_NE(latex.find("\\cmidrule(lr){2-3}\\cmidrule(lr){4-4}"), std::string::npos) << latex;
  EXPECT_NE(latex.find("\\textbf{12.5}"), std::string::npos) << latex;
  EXPECT_EQ(count(latex, "\\midrule"), 2U) << latex;
  EXPECT_EQ(count(latex, "{"), count(latex, "}")) << latex;
}

TEST(StudyTable, CsvHasOneLinePerCellWithAllDigits) {
  const Table table = sample();
  const std::string csv = to_csv(std::span(&table, 1));
  EXPECT_EQ(count(csv, "\n"), 1U + 8U) << csv;
  EXPECT_NE(csv.find("removal,nothing,unloaded,joint 1,deg,0.26812,0.0041,0.25,0.29,0.3003,,\n"),
            std::string::npos)
      << csv;
  EXPECT_NE(csv.find("removal,nothing,500 g,joint 1,deg,12.5,,,,,worse,\n"), std::string::npos);
  EXPECT_NE(csv.find("removal,nothing,,fits,,,,,,,,\"yes, a|b\"\n"), std::string::npos) << csv;
}

TEST(StudyTable, WhatIsUnknownIsADash) {
  Table table = sample();
  table.rows[1].cells[0].low = 1.0;  // half an interval is none
  EXPECT_NE(to_markdown(table).find("| joint\\_pose | – |"), std::string::npos);
}

TEST(StudyTable, DecimalsFollowTheLeastFigureUnlessGiven) {
  const Table table = sample();
  EXPECT_EQ(decimals_of(table, 0), 3);
  EXPECT_EQ(decimals_of(table, 2), 1);
}

}  // namespace
