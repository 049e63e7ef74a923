// SPDX-License-Identifier: Apache-2.0
//
// What a table's columns are, by their names and by what their values say of each other.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>

#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "guess/guess.hpp"
#include "record/profile.hpp"
#include "unit/guess_tables.hpp"
#include "unit/record/scratch.hpp"

namespace ravencal::guess {
namespace {

TEST(Guess, TellsAVelocitysUnitAndSignByItsPosition) {
  struct Case {
    double factor;
    const char* unit;
    double scale;
  };
  const double rpm = 30.0 / std::numbers::pi;
  const double degrees = 180.0 / std::numbers::pi;
  for (const Case& c : {Case{1.0, "rad_per_s", 1.0}, Case{degrees, "deg_per_s", 1.0},
                        Case{-1.0, "rad_per_s", -1.0}, Case{rpm, "deg_per_s", 6.0}}) {
    const record::Table table = table_of({{"time", kSeconds},
                                          {"elbow_position_rad", motion},
                                          {"elbow_velocity", times(c.factor, velocity)},
                                          {"elbow_effort_Nm", effort}});
    const auto guess = guess_profile(table, {});
    ASSERT_TRUE(guess.ok()) << guess.error().message;
    const GuessedChannel& channel = channel_of(*guess, table, "elbow_velocity");
    EXPECT_EQ(channel.unit, c.unit) << c.factor;
    EXPECT_DOUBLE_EQ(channel.scale, c.scale) << c.factor;
    EXPECT_EQ(channel.role, "motor_velocity");
    EXPECT_EQ(channel.joint, "elbow");
    EXPECT_EQ(asks(*guess, "sign is reversed"), c.factor < 0.0);
  }
}

TEST(Guess, SaysWhereAStatedUnitIsNotTheValues) {
  const record::Table table =
      table_of({{"t_s", kSeconds}, {"q_rad", motion}, {"dq_deg_s", velocity}, {"tau_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "dq_deg_s").unit, "rad_per_s");
  EXPECT_TRUE(asks(*guess, "dq_deg_s names deg_per_s, but q_rad says rad_per_s"));
}

TEST(Guess, TellsDegreesByTheVelocity) {
  const record::Table table = table_of({{"t", kSeconds},
                                        {"q", times(180.0 / std::numbers::pi, motion)},
                                        {"dq_rad_s", velocity},
                                        {"tau_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "q").unit, "deg");
}

TEST(Guess, TurnsAnEffortThatActsAgainstTheMotion) {
  for (const double sign : {1.0, -1.0}) {
    const record::Table table =
        table_of({{"t_s", kSeconds}, {"q_rad", motion}, {"torque_Nm", times(sign, effort)}});
    const auto guess = guess_profile(table, {});
    ASSERT_TRUE(guess.ok()) << guess.error().message;
    EXPECT_EQ(channel_of(*guess, table, "torque_Nm").role, "drive_torque");
    EXPECT_DOUBLE_EQ(channel_of(*guess, table, "torque_Nm").scale, sign);
  }
}

TEST(Guess, FindsTheJointOfAnEffortByItsMotion) {
  const Signal other = [](double t_s) { return 0.7 * std::sin(2.2 * t_s); };
  const record::Table table = table_of({{"t_s", kSeconds},
                                        {"knee_pos_rad", other},
                                        {"hip_pos_rad", motion},
                                        {"motor_b_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "motor_b_Nm").joint, "hip");
  EXPECT_TRUE(asks(*guess, "motor_b_Nm: of which joint?"));
}

TEST(Guess, TakesTheLeadingPositionForTheCommand) {
  const Signal late = [](double t_s) { return motion(t_s - 0.03); };
  const record::Table table = table_of({{"t_s", kSeconds}, {"q1_rad", late}, {"qd1_rad", motion}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "qd1_rad").role, "joint_estimate");
  EXPECT_EQ(channel_of(*guess, table, "q1_rad").role, "joint_truth");
}

TEST(Guess, ScalesAMotorThatTurnsFurtherAndTheOtherWay) {
  const record::Table table =
      table_of({{"t_s", kSeconds},
                {"motor_elbow_rad", times(-50.0, motion)},
                {"elbow_true_rad", [](double t_s) {
                   return motion(t_s) + 0.01 * ((velocity(t_s) > 0.0) - (velocity(t_s) < 0.0));
                 }}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  const GuessedChannel& motor = channel_of(*guess, table, "motor_elbow_rad");
  EXPECT_EQ(motor.role, "joint_estimate");
  EXPECT_NEAR(motor.scale, -0.02, 0.0005);
  EXPECT_EQ(channel_of(*guess, table, "elbow_true_rad").role, "joint_truth");
}

TEST(Guess, TakesAPositionThatTheMotorsGiveExactlyForNoSecondEncoder) {
  const record::Table table = table_of({{"t_s", kSeconds},
                                        {"mpos1_rad", times(50.0, motion)},
                                        {"jpos1_rad", motion},
                                        {"tau1_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "mpos1_rad").role, "motor_position");
  EXPECT_EQ(channel_of(*guess, table, "jpos1_rad").role, "joint_estimate");
}

TEST(Guess, AsksOnceHoweverManyColumnsADoubtHas) {
  const Signal absolute = [](double t_s) { return t_s < 0.5 ? 0.0 : std::abs(effort(t_s)); };
  const record::Table table = table_of({{"t_s", kSeconds},
                                        {"cmd_a_deg", motion},
                                        {"pos_a_deg", [](double t) { return motion(t - 0.02); }},
                                        {"current_a", absolute},
                                        {"cmd_b_deg", motion},
                                        {"pos_b_deg", [](double t) { return motion(t - 0.02); }},
                                        {"current_b", absolute}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(guess->questions.size(), 2U) << fmt::format("{}", fmt::join(guess->questions, "\n"));
  EXPECT_EQ(channel_of(*guess, table, "current_a").role, "feature");
}

TEST(Guess, RefusesATableWithoutAJoint) {
  const record::Table table = table_of({{"t_s", kSeconds}, {"voltage_V", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_FALSE(guess.ok());
  EXPECT_NE(guess.error().message.find("run.csv: no joint has a position"), std::string::npos);
  EXPECT_NE(guess.error().message.find("t_s, voltage_V"), std::string::npos);
}

TEST(Guess, WritesAProfileThatReadsTheTable) {
  const record::Table table = table_of({{"t_ms", times(1e3, kSeconds)},
                                        {"q \"1\" [deg]", times(180.0 / std::numbers::pi, motion)},
                                        {"dq 1", times(-1.0, velocity)},
                                        {"tau 1", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  const record::testing::Scratch scratch;
  const auto path = scratch.write("run.toml", profile_text(*guess, table));
  const auto profile = record::load_profile(path.string());
  ASSERT_TRUE(profile.ok()) << profile.error().message;
  const auto recording = record::load_table(table, *profile, {});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  const auto position = recording->column(record::Role::kMotorPosition, "joint1");
  const auto speed = recording->column(record::Role::kMotorVelocity, "joint1");
  ASSERT_TRUE(position && speed);
  EXPECT_EQ(recording->t_ns[10], 40'000'000);
  EXPECT_NEAR(recording->samples(10, *position), motion(10 * kStepS), 1e-12);
  EXPECT_NEAR(recording->samples(10, *speed), velocity(10 * kStepS), 1e-12);
}

/// Roles that the shipped profiles give, by the columns of their files.
TEST(GuessOnRealData, AgreesWithTheShippedProfiles) {
  struct Case {
    const char* file;
    const char* profile;
    std::size_t roles;  ///< of the profile, other than features, that the guess must give
  };
  const Case cases[] = {{"so101/multisine.csv", "so101", 10},
                        {"bam_xl330/xl330_kp100_sin_sin.csv", "bam_xl330", 5},
                        {"double_pendulum/train_run00.csv", "double_pendulum", 8},
                        {"emps/emps_train.csv", "emps", 4},
                        {"dvrk_berkeley/train_peg.csv", "dvrk_berkeley", 12}};
  for (const Case& c : cases) {
    const std::filesystem::path path = std::filesystem::path(RAVENCAL_DATA_DIR) / c.file;
    if (!std::filesystem::exists(path))
      GTEST_SKIP() << "no recordings in " << RAVENCAL_DATA_DIR << "; set RAVENCAL_DATA_DIR";
    const auto table = exchange::read_table(path);
    ASSERT_TRUE(table.ok()) << table.error().message;
    const auto guess = guess_profile(*table, {});
    ASSERT_TRUE(guess.ok()) << guess.error().message;
    const auto shipped = record::load_profile(
        fmt::format("{}/tools/profiles/{}.toml", RAVENCAL_SOURCE_DIR, c.profile));
    ASSERT_TRUE(shipped.ok()) << shipped.error().message;
    std::size_t same = 0;
    for (const record::ProfileChannel& channel : shipped->channels) {
      const std::string role(record::name_of(channel.channel.role));
      if (role == "feature" || role == "status") continue;
      const GuessedChannel& guessed = channel_of(*guess, *table, channel.column);
      EXPECT_EQ(guessed.role, role) << c.file << " " << channel.column;
      EXPECT_EQ(guessed.unit, channel.channel.unit) << c.file << " " << channel.column;
      same += guessed.role == role ? 1U : 0U;
    }
    EXPECT_GE(same, c.roles) << c.file;
  }
}

}  // namespace
}  // namespace ravencal::guess
