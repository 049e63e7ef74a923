// SPDX-License-Identifier: Apache-2.0
//
// What a report says in sentences: words instead of ids, and figures that agree with its tables.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "diagnose/explain/models.hpp"
#include "diagnose/findings/figures.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/report/causes.hpp"
#include "diagnose/report/overview.hpp"
#include "diagnose/report/write_report.hpp"

namespace ravencal::diagnose {
namespace {

NamedEffect friction() {
  NamedEffect e;
  e.id = "load_dependent_friction";
  e.joint = "elbow";
  e.stage = "drive";
  e.parameters = {{"load_share", 0.05, "N_m_s_per_rad", {0.04, 0.06}}};
  e.unit = "N_m";
  e.held_out_before = 0.203;
  e.held_out_after = 0.05;
  e.ambiguous_with = {"asymmetric_friction"};
  e.separate_by = "lift another weight";
  return e;
}

/// Joint "elbow", of which effort and position were recorded and held out.
Report seen(std::size_t held_out_rows = 900) {
  Report report;
  for (const char* stage : {"drive", "transmission"}) {
    LookedAt looked;
    looked.joint = "elbow";
    looked.stage = stage;
    looked.rows = 1000;
    looked.held_out_rows = held_out_rows;
    report.looked_at.push_back(looked);
  }
  report.held_out = {{"elbow", "effort_rmse", "N_m", 0.212, 0.05, 0.01},
                     {"elbow", "position_rmse", "rad", 0.160, 0.161, 0.001},
                     {"elbow", "free_run_1s_rmse", "rad", 0.02, 0.01}};
  return report;
}

TEST(DiagnoseSentences, HaveWordsWhereFilesHaveIds) {
  Report report = seen();
  report.effects = {friction()};
  report.verdict.false_alarm_rate = 0.0;
  report.verdict.placebos = 20;
  decide(report);
  EXPECT_EQ(report.verdict.text.find('_'), std::string::npos) << report.verdict.text;
  EXPECT_NE(report.verdict.text.find("load dependent friction (load share 0.05 N m s/rad"),
            std::string::npos)
      << report.verdict.text;
  EXPECT_NE(report.verdict.text.find("not told apart from asymmetric friction"), std::string::npos);
  EXPECT_NE(report.verdict.text.find("something was named in 0 of 20"), std::string::npos);
  NotFound untested{"lost_counts", "elbow", std::nullopt, "", "the joint stood", "", true};
  report.not_found = {untested};
  const auto next = nlohmann::json::parse(report_json(report))["next"];
  ASSERT_GE(next.size(), 2U) << next;
  for (const auto& one : next)
    EXPECT_EQ(one["why"].get<std::string>().find('_'), std::string::npos) << one;
  report = seen();
  decide(report);
  EXPECT_EQ(report.verdict.text.find('_'), std::string::npos) << report.verdict.text;
}

/// What the improved plant leaves without an effect is not what the plant leaves as it is.
TEST(DiagnoseSentences, CallTheErrorWithoutAnEffectThat) {
  Report report = seen();
  report.effects = {friction()};
  decide(report);
  EXPECT_NE(report.verdict.text.find("the improved plant's error on motion that no fit saw is "
                                     "0.203 N m without it and 0.05 N m with it"),
            std::string::npos)
      << report.verdict.text;
}

/// A slip belongs to one recording: the figures of the plant, which cannot hold it, keep its error.
TEST(DiagnoseSentences, SayThatTheFiguresAreWithoutWhatNoPlantCanHold) {
  Report report = seen();
  NamedEffect slip = friction();
  slip.id = "slip";
  slip.stage = "transmission";
  slip.unit = "rad";
  slip.held_out_before = 0.1613;
  slip.held_out_after = 0.002566;
  slip.of_fitted_rows = slip.beyond_plants = true;
  report.effects = {slip};
  decide(report);
  EXPECT_NE(
      report.verdict.text.find("error on the rows that were fitted is 9.24 deg without it and "
                               "0.147 deg with it, and no plant can hold it"),
      std::string::npos)
      << report.verdict.text;
  const auto lines = joint_lines(report, causes_of(report));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].sentence.find("position error on motion that no fit saw 9.17 deg, now 9.22 "
                                   "deg (+0.6 %); no plant can hold slip"),
            std::string::npos)
      << lines[0].sentence;
}

TEST(DiagnoseSentences, SayWhichRowsWereFittedWhereNoneWereHeldOut) {
  const Report report = seen(0);
  EXPECT_TRUE(are_of_fitted_rows(report));
  EXPECT_FALSE(are_of_fitted_rows(seen()));
  const auto lines = joint_lines(report, {});
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].sentence.find("position error on the rows that were fitted 9.17 deg"),
            std::string::npos)
      << lines[0].sentence;
}

/// What has no name takes nothing away: its evidence is the figure of its channel.
TEST(DiagnoseSentences, GiveWhatHasNoNameTheFigureOfItsChannel) {
  Report report = seen();
  ErrorLeft left;
  left.joint = "elbow";
  left.stage = "drive";
  left.unit = "N_m";
  left.before = 0.246;
  left.left = 0.2;
  left.measured_by = "repetition";
  left.floor = 0.1;
  left.allowed = 0.15;
  left.reached = false;
  report.left = {left};
  decide(report);
  ASSERT_EQ(report.effects.size(), 1U);
  EXPECT_EQ(report.effects[0].id, kUnknown);
  EXPECT_EQ(report.effects[0].held_out_before, 0.212);
  EXPECT_EQ(report.effects[0].held_out_after, 0.05);
}

TEST(DiagnoseSentences, GiveNoFloorToARunThatNoSensorBounds) {
  const auto json = nlohmann::json::parse(report_json(seen()));
  EXPECT_EQ(json["held_out"][0]["floor"], 0.01);
  EXPECT_TRUE(json["held_out"][2]["floor"].is_null()) << json["held_out"][2];
}

/// A cell with a row was visited, although it takes more rows for a figure.
TEST(DiagnoseSentences, CountACellWithRowsAsVisited) {
  Report report = seen();
  ChannelPlot plot;
  plot.joint = "elbow";
  plot.stage = "drive";
  plot.where.rows.assign(60, 0);
  std::fill_n(plot.where.rows.begin(), 44, 1U);
  plot.where.before.assign(60, std::numeric_limits<double>::quiet_NaN());
  plot.where.after = plot.where.before;
  report.plots = {plot};
  report.recordings = {{"a.db", false, 60.0}};
  const auto json = nlohmann::json::parse(report_json(report));
  EXPECT_EQ(json["channels"][0]["where"]["cells_visited"], 44);
  const std::string next = json["next"].dump();
  EXPECT_NE(next.find("44 of 60 cells of position and speed hold rows"), std::string::npos) << next;
}

/// Laws of other forms differ by a share of the number. A relative change is one of the whole.
TEST(DiagnoseSentences, AllowTwoEstimatesAShareOfTheNumber) {
  Parameter share;
  share.effect = "load_dependent_friction";
  share.name = "load_share";
  share.unit = "1";
  share.nominal = 0.05;
  EXPECT_NEAR(deviation_of_form(share), 0.002, 1e-12);
  Parameter ratio = share;
  ratio.effect = "torque_constant";
  ratio.name = "ratio";
  EXPECT_NEAR(deviation_of_form(ratio), 0.042, 1e-12);
  Parameter level = share;
  level.effect = "coulomb_friction";
  level.name = "level";
  level.unit = "N_m";
  level.nominal = 0.5;
  EXPECT_NEAR(deviation_of_form(level), 0.02, 1e-12);
}

}  // namespace
}  // namespace ravencal::diagnose
