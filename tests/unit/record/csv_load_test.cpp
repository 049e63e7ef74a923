// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "record/load.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

Recording load(const std::filesystem::path& path, const std::string& profile,
               unsigned threads = 0) {
  LoadOptions options;
  options.profile = profile;
  options.threads = threads;
  auto loaded = load_recording(path, options);
  EXPECT_TRUE(loaded.ok()) << loaded.error().message;
  return loaded.ok() ? std::move(loaded).value() : Recording();
}

TEST(GenericCsv, TakesUnitsRolesAndJointsFromTheHeader) {
  const Scratch scratch;
  const auto path = scratch.write("a.csv",
                                  "t_ms,truth.elbow_deg,estimate.elbow_rad,motor.elbow_deg,"
                                  "torque.elbow_N_m,supply_V,force_N,speed_deg_per_s,count_1\n"
                                  "10,180,1,90,2,3,4,180,5\n");
  const Recording r = load(path, "generic");
  ASSERT_EQ(r.channels.size(), 8U);
  EXPECT_EQ(r.t_ns[0], 10'000'000);
  EXPECT_EQ(r.channels[3].name, "torque.elbow");
  EXPECT_EQ(r.channels[3].unit, "N_m");
  EXPECT_EQ(r.channels[3].role, Role::kDriveTorque);
  EXPECT_EQ(r.channels[3].joint, "elbow");
  EXPECT_EQ(r.channels[4].role, Role::kFeature);
  EXPECT_DOUBLE_EQ(r.samples(0, 0), std::numbers::pi);
  EXPECT_DOUBLE_EQ(r.samples(0, 6), std::numbers::pi);
  EXPECT_EQ(r.calibratable_joints(), std::vector<std::string>{"elbow"});
}

TEST(GenericCsv, ReadsEveryCommonWayToWriteAFile) {
  const std::string body[] = {
      "t_s,a_1\n0,1.5\n1,-2e3\n",
      "t_s,a_1\r\n0,1.5\r\n1,-2e3\r\n",
      "t_s,a_1\n0,1.5\n1,-2e3",
      "# t_s,a_1\n0,1.5\n1,-2e3\n\n",
      "\xEF\xBB\xBFt_s,a_1\n0,1.5\n1,-2e3",
      "\"t_s\",\"a_1\"\n 0 , +1.5\n1, -2.000E+03\r\n",
      "t_s, a_1\n0.000000000000000000e+00,1.500000000000000000e+00\n1,-2000.0000000000000000000\n"};
  const Scratch scratch;
  for (const std::string& text : body) {
    const Recording r = load(scratch.write("a.csv", text), "generic");
    ASSERT_EQ(r.rows(), 2) << text;
    EXPECT_EQ(r.samples(0, 0), 1.5) << text;
    EXPECT_EQ(r.samples(1, 0), -2000.0) << text;
    EXPECT_EQ(r.t_ns[1], 1'000'000'000) << text;
  }
}

// Rows of very different lengths, so that chunk borders fall everywhere, also on line ends.
TEST(GenericCsv, GivesTheSameWithAnyNumberOfThreads) {
  const Scratch scratch;
  std::string text = "t_s,a_1,b_1\n";
  const int rows = 60000;
  for (int i = 0; i < rows; ++i) {
    text += fmt::format("{},{},{}{}\n", i, i * 0.25,
                        i % 7 == 0 ? std::string(static_cast<std::size_t>(i % 97), '0') : "", i);
  }
  const auto path = scratch.write("a.csv", text);
  const Recording one = load(path, "generic", 1);
  ASSERT_EQ(one.rows(), rows);
  for (int i = 0; i < rows; ++i) {
    ASSERT_EQ(one.t_ns[static_cast<std::size_t>(i)], i * 1'000'000'000LL);
    ASSERT_EQ(one.samples(i, 0), i * 0.25);
    ASSERT_EQ(one.samples(i, 1), i);
  }
  for (const unsigned threads : {2U, 5U}) {
    EXPECT_EQ(load(path, "generic", threads).samples, one.samples);
  }
}

TEST(GenericCsv, ReadsARowLongerThanAChunk) {
  const Scratch scratch;
  const std::string zeros(700 * 1024, '0');
  const Recording r =
      load(scratch.write("a.csv", "t_s,a_1\n0,1\n1," + zeros + "2\n2,3\n"), "generic");
  ASSERT_EQ(r.rows(), 3);
  EXPECT_EQ(r.samples(1, 0), 2.0);
  EXPECT_EQ(r.samples(2, 0), 3.0);
}

std::filesystem::path profile(const Scratch& scratch, const std::string& source,
                              const std::string& rest = "") {
  return scratch.write("p.toml", "[source]\n" + source +
                                     "\n[[channel]]\nname = 'est'\ncolumn = 'e'\nunit = 'mm'\nrole "
                                     "= 'joint_estimate'\njoint = 'x'\n"
                                     "[[channel]]\nname = 'tru'\ncolumn = 'w'\nunit = 'mm'\nrole = "
                                     "'joint_truth'\njoint = 'x'\nmay_be_missing = true\n" +
                                     rest);
}

TEST(ProfileCsv, KeepsOnlyTheRowsThatPassEveryFilter) {
  const Scratch scratch;
  const auto p = profile(
      scratch, "time = 't'",
      "[[filter]]\ncolumn = 'ok'\nkeep = [1, 2]\n[[filter]]\ncolumn = 'axis'\nkeep = 'x'\n");
  const Recording r =
      load(scratch.write("a.csv", "t,e,w,ok,axis\n0,1,1,1.0,x\n1,2,2,0,x\n2,3,3,1,y\n3,4,4,2,x\n"),
           p.string());
  ASSERT_EQ(r.rows(), 2);
  EXPECT_DOUBLE_EQ(r.samples(1, 0), 0.004);
  EXPECT_EQ(r.t_ns[1], 3'000'000'000);
}

TEST(ProfileCsv, ReadsMissingValuesAsLostWhereAllowed) {
  const Scratch scratch;
  const auto p = profile(scratch, "time = 't'");
  const Recording r = load(scratch.write("a.csv", "t,e,w\n0,1,nan\n1,2,\n2,3,4\n"), p.string());
  EXPECT_TRUE(std::isnan(r.samples(0, 1)));
  EXPECT_TRUE(std::isnan(r.samples(1, 1)));
  EXPECT_DOUBLE_EQ(r.samples(2, 1), 0.004);
}

TEST(ProfileCsv, TurnsTheSignOfAChannelThatCountsTheOtherWay) {
  const Scratch scratch;
  const auto p = scratch.write("p.toml",
                               "[source]\ntime = 't'\n[[channel]]\nname = 'q'\ncolumn = 'q'\n"
                               "unit = 'mm'\nnegate = true\n");
  const Recording r = load(scratch.write("a.csv", "t,q\n0,1\n1,-2\n"), p.string());
  EXPECT_DOUBLE_EQ(r.samples(0, 0), -0.001);
  EXPECT_DOUBLE_EQ(r.samples(1, 0), 0.002);
}

TEST(ProfileCsv, ScalesAndShiftsAValueInTheUnitOfTheFile) {
  const Scratch scratch;
  const auto p = scratch.write(
      "p.toml",
      "[source]\ntime = 't'\n"
      "[[channel]]\nname = 'q'\ncolumn = 'q'\nunit = 'mm'\nscale = -0.5\noffset = 3\n"
      "[[channel]]\nname = 'raw'\ncolumn = 'q'\nunit = 'm'\n"
      "[[channel]]\nname = 'since'\ncolumn = 'q'\nunit = 'mm'\noffset = 7\nrelative = true\n");
  const Recording r = load(scratch.write("a.csv", "t,q\n0,1\n1,-2\n"), p.string());
  EXPECT_DOUBLE_EQ(r.samples(0, 0), 0.0025);
  EXPECT_DOUBLE_EQ(r.samples(1, 0), 0.004);
  EXPECT_DOUBLE_EQ(r.samples(1, 1), -2.0);
  EXPECT_DOUBLE_EQ(r.samples(0, 2), 0.0);
  EXPECT_DOUBLE_EQ(r.samples(1, 2), -0.003);
  EXPECT_EQ(r.meta.at("origin.since"), "0.008");
}

TEST(ProfileCsv, LosesTheTruthOfATransientAndNothingElse) {
  const Scratch scratch;
  const auto p = scratch.write(
      "p.toml",
      "[source]\ntime = 't'\ntruth_from_s = 1.5\n"
      "[[channel]]\nname = 'e'\ncolumn = 'e'\nunit = 'rad'\nrole = 'joint_estimate'\njoint = 'j'\n"
      "[[channel]]\nname = 'w'\ncolumn = 'w'\nunit = 'rad'\nrole = 'joint_truth'\njoint = 'j'\n");
  const Recording r =
      load(scratch.write("a.csv", "t,e,w\n5,1,1\n6,2,2\n6.5,3,3\n7,4,4\n"), p.string());
  EXPECT_TRUE(std::isnan(r.samples(0, 1)));
  EXPECT_TRUE(std::isnan(r.samples(1, 1)));
  EXPECT_DOUBLE_EQ(r.samples(2, 1), 3.0);
  EXPECT_TRUE(r.samples.col(0).allFinite());
}

TEST(ProfileCsv, SaysThatTheRobotHomedBefore) {
  const Scratch scratch;
  const auto csv = scratch.write("a.csv", "t,e,w\n5,1,1\n6,2,2\n");
  const Recording homed = load(csv, profile(scratch, "time = 't'\nhomed = true").string());
  ASSERT_EQ(homed.events.size(), 1U);
  EXPECT_EQ(homed.events[0].kind, "homing");
  EXPECT_EQ(homed.events[0].t_ns, homed.t_ns[0]);
  EXPECT_TRUE(load(csv, profile(scratch, "time = 't'").string()).events.empty());
}

TEST(ProfileCsv, CountsRowsWhereTheTimeIsMissing) {
  const Scratch scratch;
  const auto p = profile(scratch, "time = 't'\ntime_missing = 'row_number'\nrow_period_s = 0.5");
  const Recording r = load(scratch.write("a.csv", "t,e,w\nnan,1,1\nnan,2,2\n"), p.string());
  EXPECT_EQ(r.t_ns, (std::vector<std::int64_t>{0, 500'000'000}));
}

TEST(ProfileCsv, KeepsWhatItTookTheTimeFrom) {
  const Scratch scratch;
  const auto csv = scratch.write("a.csv", "e,w\n1,1\n2,2\n");
  const Recording assumed = load(csv, profile(scratch, "").string());
  EXPECT_EQ(assumed.meta.at("assumed_row_period_s"), "0.01");
  const Recording stated = load(csv, profile(scratch, "row_period_s = 0.002").string());
  EXPECT_FALSE(stated.meta.contains("assumed_row_period_s"));
  EXPECT_EQ(stated.t_ns[1], 2'000'000);
  const auto missing = profile(scratch, "time = 't'\ntime_missing = 'row_number'");
  const Recording lost = load(scratch.write("b.csv", "t,e,w\n0,1,1\nnan,2,2\n"), missing.string());
  EXPECT_EQ(lost.meta.at("assumed_row_period_s"), "0.01") << "some stamps were there";
  const auto given = profile(scratch, "time = 't'");
  EXPECT_FALSE(load(scratch.write("c.csv", "t,e,w\n0,1,1\n1,2,2\n"), given.string())
                   .meta.contains("assumed_row_period_s"));
}

TEST(ProfileCsv, SplitsEpisodesAndRefersTheTruthToTheirFirstRow) {
  const Scratch scratch;
  const auto p =
      profile(scratch, "time = 't'\nepisode = 'run'\nreference = 'first'\nrow_period_s = 0.1");
  const Recording r =
      load(scratch.write("a.csv", "t,e,w,run\n0,1,nan,a\n1,2,7,a\n2,3,9,a\n0,1,1,b\n1,2,3,b\n"),
           p.string());
  ASSERT_EQ(r.rows(), 5);
  EXPECT_TRUE(std::isnan(r.samples(0, 1)));
  EXPECT_NEAR(r.samples(1, 1), 0.002, 1e-15) << "the first row with both is the reference";
  EXPECT_NEAR(r.samples(2, 1), 0.004, 1e-15);
  EXPECT_NEAR(r.samples(4, 1), 0.003, 1e-15);
  EXPECT_EQ(r.t_ns[3], 2'100'000'000) << "time goes on where the episode before ended";
  ASSERT_EQ(r.events.size(), 2U);
  EXPECT_EQ(r.events[1].kind, "episode");
  EXPECT_EQ(r.events[1].t_ns, r.t_ns[3]);
  EXPECT_EQ(r.events[1].detail, "run = b");
}

TEST(ProfileCsv, BeginsAnEpisodeWhereTimeRestartsIfToldSo) {
  const Scratch scratch;
  const auto p = profile(scratch, "time = 't'\ntime_restarts = true\nrow_period_s = 0.5");
  const Recording r =
      load(scratch.write("a.csv", "t,e,w\n0,1,1\n5,2,2\n1,3,3\n2,4,4\n"), p.string());
  EXPECT_EQ(r.t_ns, (std::vector<std::int64_t>{0, 5'000'000'000, 5'500'000'000, 6'500'000'000}));
  ASSERT_EQ(r.events.size(), 1U);
  EXPECT_EQ(r.events[0].t_ns, 5'500'000'000);
}

TEST(ProfileCsv, BlanksValuesWhereTheirConditionFails) {
  const Scratch scratch;
  const auto p = scratch.write("p.toml",
                               "[source]\n[[channel]]\nname = 'w'\ncolumn = 'w'\nunit = 'm'\n"
                               "valid_when = {column = 'axis', equals = 'x'}\n"
                               "[[channel]]\nname = 'again'\ncolumn = 'w'\nunit = 'mm'\n");
  const Recording r = load(scratch.write("a.csv", "w,axis\n1,x\n2,y\n"), p.string());
  EXPECT_EQ(r.samples(0, 0), 1.0);
  EXPECT_TRUE(std::isnan(r.samples(1, 0)));
  EXPECT_DOUBLE_EQ(r.samples(1, 1), 0.002) << "one column may feed two channels";
}

}  // namespace
}  // namespace ravencal::record
