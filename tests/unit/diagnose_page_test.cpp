// SPDX-License-Identifier: Apache-2.0
//
// The page of a diagnosis: its words against the JSON, its cards, and how it looks in a browser.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/whole_file.hpp"
#include "diagnose/report/causes.hpp"
#include "diagnose/report/write_report.hpp"
#include "unit/browser.hpp"
#include "unit/diagnose_page_sample.hpp"

namespace ravencal::diagnose {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

/// The text without what stands between `open` and `close`.
std::string without(std::string text, const std::string& open, const std::string& close) {
  for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at))
    text.replace(at, text.find(close, at) + close.size() - at, " ");
  return text;
}

/// What a reader reads of a drawn page but in its charts.
std::string words_of(const std::string& dom) {
  const std::string body =
      dom.substr(dom.find("<header>"), dom.find("<footer>") - dom.find("<header>"));
  const std::string words = without(without(body, "<svg", "</svg>"), "<", ">");
  return std::regex_replace(words, std::regex("&[a-z]+;"), " ");
}

/// A number as it stands in a text, sign apart, and the unit behind it where pages convert to that.
using Said = std::pair<std::string, std::string>;

std::set<Said> numbers_in(const std::string& text) {
  static const std::regex number(
      R"((?:^|[^\w.])(\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?![\w.]*\w)(?:\s+(deg|mm|%))?)");
  std::set<Said> found;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), number);
       it != std::sregex_iterator(); ++it)
    found.insert({(*it)[1], (*it)[2]});
  return found;
}

/// Every way in which a page may write a number of the report that has this unit.
void add_ways_to_write(double value, const std::string& unit, std::set<Said>& ways) {
  const double size = std::abs(value);
  const double per_rad = 180.0 / std::numbers::pi;
  if (unit == "rad") ways.insert({fmt::format("{:.3g}", size * per_rad), "deg"});
  if (unit == "m") ways.insert({fmt::format("{:.3g}", size * 1e3), "mm"});
  for (const char* format : {"{:.3g}", "{:.0f}", "{:.1f}", "{:.2f}"})
    ways.insert({fmt::format(fmt::runtime(format), size * 100.0), "%"});
  if (unit == "rad" || unit == "m") return;
  for (const char* format : {"{:.3g}", "{:.0f}", "{:.1f}", "{:.2f}", "{:.4f}"})
    ways.insert({fmt::format(fmt::runtime(format), size), ""});
}

/// `unit` is that of the object that holds the number, where its key does not say seconds; a count
/// of rows has none.
void add_numbers_of(const Json& json, const std::string& unit, std::set<Said>& ways) {
  if (json.is_number_integer()) return add_ways_to_write(json.get<double>(), "", ways);
  if (json.is_number()) return add_ways_to_write(json.get<double>(), unit, ways);
  if (json.is_string()) return ways.merge(numbers_in(json.get<std::string>()));
  if (!json.is_structured()) return;
  const std::string own = json.is_object() ? json.value("unit", unit) : unit;
  for (const auto& [key, child] : json.items()) {
    if (key == "points" || key == "traces") continue;
    add_numbers_of(child, key.ends_with("_s") ? "s" : own, ways);
    if (json.is_object() && json.contains("position_unit"))
      add_numbers_of(child, json["position_unit"], ways);
  }
}

/// What a page about this report may say. The first ones are of "95 %" intervals, of free runs over
/// 1 s, of the form of laws and of the least probability that is written out.
std::set<Said> known_in(const Report& report) {
  std::set<Said> known = {{"95", "%"}, {"1", ""}, {"4", "%"}, {"0.0001", ""}};
  for (const TwoEstimates& e : report.two_estimates)
    known.insert({fmt::format("{:.3g}", std::abs(e.free_run - e.equation_error)), ""});
  add_numbers_of(Json::parse(report_json(report)), "", known);
  return known;
}

constexpr int kScreen_px = 1280;
/// A4 at 96 dots per inch less Chromium's margins.
constexpr int kPaper_px = 718;
constexpr const char* kHostile =
    "</script><script>document.title='taken'</script><!-- <img src=x "
    "onerror=\"document.title='taken'\">";

/// The sample with no two sizes alike, so that a number on the wrong card shows.
Report distinct_sizes() {
  Report report = sample_diagnosis();
  for (std::size_t i = 0; i < report.effects.size(); ++i) {
    NamedParameter& parameter = report.effects[i].parameters.front();
    const double size = 0.1357 + 0.0123 * static_cast<double>(i);
    parameter.value = size;
    parameter.ci95 = {0.91 * size, 1.07 * size};
  }
  return report;
}

Report hostile_nothing() {
  Report report = sample_of_nothing();
  report.not_looked_at.front().because = kHostile;
  return report;
}

/// One page with findings and one without, each drawn once for all tests.
class DiagnosisPage : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!test::has_browser()) return;
    folder_ = fs::temp_directory_path() / fmt::format("ravencal_diagnosis_{}", getpid());
    fs::create_directories(folder_);
    found_ = open(report_html(found()), kScreen_px);
    nothing_ = open(report_html(nothing()), kScreen_px);
  }
  static void TearDownTestSuite() {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  void SetUp() override {
    if (!test::has_browser())
      GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  }

  /// The page with the inspector at its end.
  static test::Opened open(std::string page, int width_px) {
    const auto inspector =
        core::read_whole_file(fs::path(RAVENCAL_SOURCE_DIR) / "tests/unit/page_inspector.js");
    EXPECT_TRUE(inspector.ok());
    page.insert(page.rfind("</body>"), "<script>" + inspector.value() + "</script>");
    const fs::path path = folder_ / "page.html";
    EXPECT_TRUE(core::write_whole_file(path, page).ok());
    test::Opened opened = test::open_in_browser(path, folder_, width_px);
    EXPECT_TRUE(opened.ok);
    return opened;
  }

  /// What the inspector found; "?" where it did not come to an end.
  static std::string findings_in(const test::Opened& opened) {
    const std::string key = "data-findings=\"";
    const std::size_t at = opened.dom.find(key);
    if (at > opened.dom.find("<head>")) return "?";
    const std::size_t from = at + key.size();
    return opened.dom.substr(from, opened.dom.find('"', from) - from);
  }

  static const Report& found() {
    static const Report report = distinct_sizes();
    return report;
  }
  static const Report& nothing() {
    static const Report report = hostile_nothing();
    return report;
  }

  static inline fs::path folder_;
  static inline test::Opened found_, nothing_;
};

TEST_F(DiagnosisPage, SaysNoNumberThatTheJsonLacks) {
  for (const auto& [report, opened] : {std::pair{found(), found_}, {nothing(), nothing_}}) {
    const std::set<Said> known = known_in(report);
    const std::set<Said> said = numbers_in(words_of(opened.dom));
    EXPECT_GT(said.size(), 10U);
    for (const Said& number : said)
      EXPECT_TRUE(known.contains(number)) << number.first << " " << number.second;
  }
}

/// The same number with another last digit.
std::string altered(std::string number) {
  char& digit = number[std::min(number.find('e'), number.size()) - 1];
  digit = digit == '9' ? '4' : static_cast<char>(digit + 1);
  return number;
}

TEST_F(DiagnosisPage, IsCaughtAtANumberThatIsWrongInItsLastDigit) {
  // The test's own alarm: what it lets pass are short numbers that the report has elsewhere.
  const std::set<Said> known = known_in(found());
  int passed = 0, all = 0;
  for (const auto& [number, unit] : numbers_in(words_of(found_.dom))) {
    passed += known.contains({altered(number), unit}) ? 1 : 0;
    ++all;
  }
  EXPECT_LE(5 * passed, all) << passed << " of " << all << " wrong numbers pass";
}

std::string shown(double value, const std::string& unit) {
  if (unit == "rad") return fmt::format("{:.3g} deg", value * 180.0 / std::numbers::pi);
  if (unit == "m") return fmt::format("{:.3g} mm", value * 1e3);
  return fmt::format("{:.3g}", value);
}

TEST_F(DiagnosisPage, SaysEachSizeWithItsIntervalOnTheCardOfItsCause) {
  const std::string& dom = found_.dom;
  std::vector<std::string> cards;
  const std::string begin = "<article class=\"card\">";
  for (std::size_t at = dom.find(begin); at != std::string::npos; at = dom.find(begin, at + 1))
    cards.push_back(without(dom.substr(at, dom.find("</article>", at) - at), "<svg", "</svg>"));
  const std::vector<Cause> causes = causes_of(found());
  ASSERT_EQ(cards.size(), causes.size());
  for (std::size_t i = 0; i < causes.size(); ++i) {
    for (const std::size_t number : causes[i].effects) {
      const NamedParameter& parameter = found().effects[number].parameters.front();
      for (const double value : {parameter.value, parameter.ci95.first, parameter.ci95.second})
        EXPECT_NE(cards[i].find(shown(value, parameter.unit)), std::string::npos)
            << causes[i].name << ": " << value << "\n"
            << cards[i];
    }
  }
}

TEST_F(DiagnosisPage, SaysTheSentencesOfTheJson) {
  const Json json = Json::parse(report_json(found()));
  std::vector<Json> sentences = {json["verdict"]["headline"], json["verdict"]["text"]};
  ASSERT_EQ(json["joints"].size(), 3U);
  for (const Json& joint : json["joints"]) sentences.push_back(joint["sentence"]);
  for (const Json& cause : json["causes"]) sentences.push_back(cause["sentence"]);
  for (const Json& next : json["next"]) {
    sentences.push_back(next["experiment"]);
    sentences.push_back(next["why"]);
  }
  const std::string words = words_of(found_.dom);
  for (const Json& sentence : sentences)
    EXPECT_NE(words.find(sentence.get<std::string>()), std::string::npos) << sentence;
}

TEST_F(DiagnosisPage, HasOneCardPerCauseAndAPayloadIsOne) {
  const std::vector<Cause> causes = causes_of(found());
  ASSERT_EQ(causes.size(), 3U);
  EXPECT_EQ(causes[0].name, "load on the arm");
  EXPECT_EQ(causes[0].joints, (std::vector<std::string>{"shoulder", "elbow", "insertion"}));
  EXPECT_EQ(causes[1].status, "tied");
  ASSERT_EQ(causes[1].partings.size(), 1U);
  EXPECT_EQ(causes[1].partings.front().rival, "compliance");
  EXPECT_TRUE(causes[1].partings.front().minutes.has_value());
  EXPECT_EQ(causes[2].name, "friction of the drive");
  EXPECT_EQ(causes[2].effects.size(), 2U);
  EXPECT_EQ(count_of(found_.dom, "<article class=\"card\">"), 3U);
}

/// One figure per channel of the plant as it is; what is judged on fewer rows is none.
TEST_F(DiagnosisPage, HasOneErrorPerChannelOfThePlantAsItIs) {
  EXPECT_EQ(count_of(found_.dom, ">plant as it is</th>"), 2U) << "every figure, and drifts";
  EXPECT_EQ(count_of(found_.dom, "unseen error"), 0U);
  EXPECT_GE(count_of(found_.dom,
                     "<dt>error of the improved plant on motion that no fit saw, "
                     "without it → with it</dt>"),
            4U);
}

TEST_F(DiagnosisPage, WritesOutNoProbabilityOfZeroAndNoIds) {
  EXPECT_EQ(found_.dom.find(">0.0000<"), std::string::npos);
  EXPECT_NE(found_.dom.find("<dt>p</dt><dd>&lt; 0.0001</dd>"), std::string::npos);
  const std::regex id("[a-z]_[a-z]");
  std::smatch at;
  const std::string words = words_of(found_.dom);
  EXPECT_FALSE(std::regex_search(words, at, id))
      << at.str() << " in " << at.suffix().str().substr(0, 60);
}

TEST_F(DiagnosisPage, SaysWhatTwoEstimatesMayDifferBy) {
  const std::string words = words_of(found_.dom);
  EXPECT_NE(words.find("0.021 N m"), std::string::npos);
  EXPECT_NE(words.find("0.0471 N m"), std::string::npos);
}

TEST_F(DiagnosisPage, SaysWhatIsNotKnownOfWhereFrictionSits) {
  EXPECT_NE(
      found_.dom.find("It sits on the motor's side of the motor's encoder. These recordings do "
                      "not show on which side of the gearbox it sits. To decide it: take"),
      std::string::npos);
}

TEST_F(DiagnosisPage, ShowsInRedWhatBecameWorse) {
  EXPECT_NE(found_.dom.find("<dt>shoulder</dt><dd class=\"worse\">"), std::string::npos);
  EXPECT_EQ(found_.dom.find("<dt>elbow</dt><dd class=\"worse\">"), std::string::npos);
}

TEST_F(DiagnosisPage, KeepsRecordingsApart) {
  EXPECT_NE(found_.dom.find("<td>zigzag.db</td><td>fitted</td>"), std::string::npos);
  EXPECT_NE(found_.dom.find("<td>random.db</td><td>held out</td>"), std::string::npos);
  EXPECT_GE(count_of(found_.dom, "<h3>shoulder, transmission in random.db</h3>"), 1U);
  EXPECT_GE(count_of(found_.dom, "<h3>shoulder, transmission in zigzag.db</h3>"), 1U);
}

TEST_F(DiagnosisPage, SaysWhatToRecordNextWhereNothingWasFound) {
  const Json json = Json::parse(report_json(nothing()));
  EXPECT_EQ(json["verdict"]["kind"], "nothing_left_out");
  EXPECT_TRUE(json["causes"].empty());
  EXPECT_GE(json["next"].size(), 2U);
  const std::string& dom = nothing_.dom;
  EXPECT_NE(dom.find("What to record next</h2><ol class=\"next\"><li>"), std::string::npos);
  EXPECT_NE(dom.find("3 of 4 cells of position and speed hold rows"), std::string::npos);
  EXPECT_EQ(count_of(dom, "<article class=\"card\">"), 0U);
}

/// The data of a page as it was written.
Json data_in(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = page.find(open) + open.size();
  return Json::parse(page.substr(from, page.find("</script>", from) - from));
}

TEST(DiagnosisData, IsTheJsonAndNothingOfItCanEndTheScript) {
  const std::string page = report_html(hostile_nothing());
  EXPECT_EQ(data_in(page), Json::parse(report_json(hostile_nothing())));
  EXPECT_EQ(count_of(page, "</script>"), count_of(report_html(sample_of_nothing()), "</script>"));
  EXPECT_EQ(page.find("<img"), std::string::npos);
  const std::size_t without_scripts = page.find("<noscript>");
  EXPECT_LT(page.find("report.json", without_scripts), page.find("</noscript>"));
}

TEST_F(DiagnosisPage, RunsNothingThatANameBrings) {
  EXPECT_NE(nothing_.dom.find("<title>Diagnosis of the simulation</title>"), std::string::npos);
  EXPECT_NE(nothing_.dom.find("&lt;img src=x"), std::string::npos) << "it is shown as text";
  EXPECT_EQ(nothing_.console, "");
}

TEST_F(DiagnosisPage, IsLegibleOnAScreen) {
  EXPECT_EQ(found_.console, "");
  EXPECT_EQ(findings_in(found_), "");
  EXPECT_EQ(findings_in(nothing_), "");
  EXPECT_EQ(found_.dom.find(">This chart could not be drawn: "), std::string::npos);
}

TEST_F(DiagnosisPage, IsLegibleOnPaperWhereEverythingWasLookedAt) {
  Report report = found();
  report.not_looked_at.clear();
  const std::string page =
      std::regex_replace(report_html(report), std::regex("@media print"), "@media all");
  const test::Opened opened = open(page, kPaper_px);
  EXPECT_EQ(opened.console, "");
  EXPECT_EQ(findings_in(opened), "");
}

TEST_F(DiagnosisPage, RingsWhereAPageIsBroken) {
  // The test's own alarm: one page with every fault that it looks for.
  std::string page = report_html(sample_of_nothing());
  page.replace(page.find("</style>"), 0,
               ".words { width: 3000px; } .note { font-size: 6px; } "
               ".next li { margin-top: -1rem; line-height: 0.3; }");
  page.insert(page.rfind("</body>"),
              "<script>document.querySelector('main').append('0'); no_such_function();</script>");
  const test::Opened opened = open(page, kScreen_px);
  EXPECT_NE(opened.console.find("no_such_function"), std::string::npos) << opened.console;
  const std::string findings = findings_in(opened);
  for (const char* fault : {"wide: ", "small: ", "overlap: ", "bare: "})
    EXPECT_NE(findings.find(fault), std::string::npos) << fault << "\n" << findings;
}

TEST_F(DiagnosisPage, RingsWhereItIsNotDrawn) {
  std::string page = report_html(sample_of_nothing());
  const std::string wanted = "report.verdict.headline";
  page.replace(page.rfind(wanted), wanted.size(), "report.no_such_part.headline");
  const test::Opened opened = open(page, kScreen_px);
  EXPECT_NE(opened.console.find("TypeError"), std::string::npos) << opened.console;
  EXPECT_EQ(findings_in(opened), "?");
}

}  // namespace
}  // namespace ravencal::diagnose
