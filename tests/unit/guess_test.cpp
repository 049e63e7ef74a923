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
#include "guess/column_name.hpp"
#include "guess/guess.hpp"
#include "record/profile.hpp"
#include "unit/record/scratch.hpp"

namespace ravencal::guess {
namespace {

constexpr double kStepS = 0.004;

/// One joint's motion: two sines, in rad, with its derivatives.
double motion(double t_s) { return 0.8 * std::sin(1.3 * t_s) + 0.3 * std::sin(4.1 * t_s + 0.5); }
double velocity(double t_s) {
  return 0.8 * 1.3 * std::cos(1.3 * t_s) + 0.3 * 4.1 * std::cos(4.1 * t_s + 0.5);
}
double acceleration(double t_s) {
  return -0.8 * 1.69 * std::sin(1.3 * t_s) - 0.3 * 16.81 * std::sin(4.1 * t_s + 0.5);
}
double effort(double t_s) {
  const double v = velocity(t_s);
  return 0.2 * acceleration(t_s) + 0.5 * v + 0.4 * ((v > 0.0) - (v < 0.0)) +
         0.6 * std::sin(motion(t_s));
}

using Signal = std::function<double(double t_s)>;
record::Table table_of(const std::vector<std::pair<std::string, Signal>>& columns) {
  record::Table table;
  table.path = "run.csv";
  for (const auto& [name, signal] : columns) {
    record::TableColumn column;
    column.name = name;
    for (int row = 0; row < 5000; ++row) column.values.push_back(signal(kStepS * row));
    table.columns.push_back(std::move(column));
  }
  return table;
}
const Signal kTime = [](double t_s) { return t_s; };
Signal times(double factor, Signal signal) {
  return [factor, signal = std::move(signal)](double t_s) { return factor * signal(t_s); };
}

const GuessedChannel& channel_of(const Guess& guess, const record::Table& table,
                                 const std::string& column) {
  static const GuessedChannel kNone;
  for (const GuessedChannel& channel : guess.channels) {
    if (table.columns[channel.column].name == column) return channel;
  }
  ADD_FAILURE() << "no channel of " << column;
  return kNone;
}
bool asks(const Guess& guess, const std::string& word) {
  return std::any_of(guess.questions.begin(), guess.questions.end(),
                     [&](const std::string& q) { return q.find(word) != std::string::npos; });
}

TEST(GuessProfile, OfMoreChannelsThanARecordingHoldsSaysSo) {
  record::Table table;
  table.path = "wide.csv";
  for (std::size_t c = 0; c < record::kMostChannels + 2; ++c) {
    record::TableColumn& column = table.columns.emplace_back();
    column.name = c == 0 ? "t_s" : fmt::format("j{}_position_rad", c);
    for (int row = 0; row < 40; ++row)
      column.values.push_back(c == 0 ? kStepS * row : motion(kStepS * row + 0.01 * double(c)));
  }
  const auto guess = guess_profile(table, {});
  ASSERT_FALSE(guess.ok());
  EXPECT_TRUE(guess.error().message.starts_with(
      "wide.csv: 2000 channels; a recording holds at most 1999; take columns out"))
      << guess.error().message;
}

TEST(ColumnName, ReadsQuantitySideUnitAndJoint) {
  struct Case {
    const char* name;
    std::optional<Quantity> quantity;
    std::optional<Side> side;
    const char* unit;
    const char* joint;
  };
  const Case cases[] = {
      {"vel_wrist_roll_deg_s", Quantity::kVelocity, {}, "deg_per_s", "wrist_roll"},
      {"qcmd1_rad", Quantity::kPosition, Side::kCommand, "rad", "1"},
      {"/joint_states/shoulder_pan_joint/position", Quantity::kPosition, {}, "", "shoulder_pan"},
      {"Elbow Pos [rad]", Quantity::kPosition, {}, "rad", "elbow"},
      {"leftKneeVelocity", Quantity::kVelocity, {}, "", "left_knee"},
      {"present_current", Quantity::kDriveSignal, Side::kMeasured, "", ""},
      {"current_position", Quantity::kPosition, {}, "", ""},
      {"tau (Nm)", Quantity::kEffort, {}, "N_m", ""},
      {"x_track_m", Quantity::kPosition, Side::kJoint, "m", "x"},
      {"x_track_std_m", Quantity::kOther, Side::kJoint, "m", "x"},
      {"time_ms", Quantity::kTime, {}, "ms", ""},
      {"m", {}, {}, "", "m"},
      {"", {}, {}, "", ""},
      // Names of public loggers: libfranka, ur_rtde, lerobot, dVRK, Dynamixel, ODrive, moteus.
      {"theta3", Quantity::kPosition, {}, "", "3"},
      {"theta3_dot", Quantity::kVelocity, {}, "", "3"},
      {"q3_ddot", Quantity::kOther, {}, "", "3"},
      {"state.dq_d[4]", Quantity::kVelocity, Side::kCommand, "", "4"},
      {"tau_J_d[2]", Quantity::kEffort, Side::kCommand, "", "2"},
      {"tau_J5", Quantity::kEffort, {}, "", "5"},
      {"tau_ext_hat_filtered_1", Quantity::kOther, Side::kJoint, "", "1"},
      {"target_moment_2", Quantity::kEffort, Side::kCommand, "", "2"},
      {"actual_TCP_pose_0", Quantity::kOther, Side::kMeasured, "", "0"},
      {"observation.state.elbow_flex.pos", Quantity::kPosition, Side::kMeasured, "", "elbow_flex"},
      {"action.wrist_roll.pos", Quantity::kPosition, Side::kCommand, "", "wrist_roll"},
      {"/PSM1/setpoint_js/insertion/position", Quantity::kPosition, Side::kCommand, "",
       "psm_1_insertion"},
      {"present_load_7", Quantity::kEffort, Side::kMeasured, "", "7"},
      {"axis1.encoder.vel_estimate", Quantity::kVelocity, Side::kMeasured, "", "1"},
      {"axis0.iq_setpoint", Quantity::kDriveSignal, Side::kCommand, "", "0"},
      {"q_current", Quantity::kDriveSignal, {}, "", ""},
      {"M6", Quantity::kEffort, {}, "", "6"},
      {"A3_link_encoder_deg", Quantity::kPosition, Side::kJoint, "deg", "a_3"},
      {"/arm_controller/state/wrist_2/feedback/velocity", Quantity::kVelocity, Side::kMeasured, "",
       "arm_controller_wrist_2"},
  };
  for (const Case& c : cases) {
    const ColumnName read = read_column_name(c.name);
    EXPECT_EQ(read.quantity, c.quantity) << c.name;
    EXPECT_EQ(read.side, c.side) << c.name;
    EXPECT_EQ(read.unit, c.unit) << c.name;
    EXPECT_EQ(read.joint, c.joint) << c.name;
  }
}

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
    const record::Table table = table_of({{"time", kTime},
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
      table_of({{"t_s", kTime}, {"q_rad", motion}, {"dq_deg_s", velocity}, {"tau_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "dq_deg_s").unit, "rad_per_s");
  EXPECT_TRUE(asks(*guess, "dq_deg_s names deg_per_s, but q_rad says rad_per_s"));
}

TEST(Guess, TellsDegreesByTheVelocity) {
  const record::Table table = table_of({{"t", kTime},
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
        table_of({{"t_s", kTime}, {"q_rad", motion}, {"torque_Nm", times(sign, effort)}});
    const auto guess = guess_profile(table, {});
    ASSERT_TRUE(guess.ok()) << guess.error().message;
    EXPECT_EQ(channel_of(*guess, table, "torque_Nm").role, "drive_torque");
    EXPECT_DOUBLE_EQ(channel_of(*guess, table, "torque_Nm").scale, sign);
  }
}

TEST(Guess, FindsTheJointOfAnEffortByItsMotion) {
  const Signal other = [](double t_s) { return 0.7 * std::sin(2.2 * t_s); };
  const record::Table table = table_of(
      {{"t_s", kTime}, {"knee_pos_rad", other}, {"hip_pos_rad", motion}, {"motor_b_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "motor_b_Nm").joint, "hip");
  EXPECT_TRUE(asks(*guess, "motor_b_Nm: of which joint?"));
}

TEST(Guess, TakesTheLeadingPositionForTheCommand) {
  const Signal late = [](double t_s) { return motion(t_s - 0.03); };
  const record::Table table = table_of({{"t_s", kTime}, {"q1_rad", late}, {"qd1_rad", motion}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "qd1_rad").role, "joint_estimate");
  EXPECT_EQ(channel_of(*guess, table, "q1_rad").role, "joint_truth");
}

TEST(Guess, ScalesAMotorThatTurnsFurtherAndTheOtherWay) {
  const record::Table table =
      table_of({{"t_s", kTime},
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
  const record::Table table = table_of({{"t_s", kTime},
                                        {"mpos1_rad", times(50.0, motion)},
                                        {"jpos1_rad", motion},
                                        {"tau1_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "mpos1_rad").role, "motor_position");
  EXPECT_EQ(channel_of(*guess, table, "jpos1_rad").role, "joint_estimate");
}

TEST(Guess, MatchesThePlantsJointsByWordsThenByOrder) {
  const Signal b = [](double t_s) { return 0.5 * std::sin(0.9 * t_s); };
  const Signal c = [](double t_s) { return 0.4 * std::sin(2.9 * t_s); };
  const record::Table table = table_of({{"t_s", kTime},
                                        {"rotation_pos_rad", motion},
                                        {"rotation_tau_Nm", effort},
                                        {"pitch_pos_rad", b},
                                        {"pitch_tau_Nm", b},
                                        {"elbow_pos_rad", c},
                                        {"elbow_tau_Nm", c}});
  const auto guess = guess_profile(table, {"pan", "lift", "elbow_flex", "gripper"});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "rotation_pos_rad").joint, "pan");
  EXPECT_EQ(channel_of(*guess, table, "pitch_tau_Nm").joint, "lift");
  EXPECT_EQ(channel_of(*guess, table, "elbow_pos_rad").joint, "elbow_flex");
  EXPECT_TRUE(asks(*guess, "rotation = pan, pitch = lift, elbow = elbow_flex"));
}

/// Position and effort of each joint, each joint with a motion of its own.
record::Table joints_table(const std::vector<std::pair<std::string, std::string>>& columns) {
  std::vector<std::pair<std::string, Signal>> all = {{"t_s", kTime}};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const double rate = 0.7 + 0.9 * static_cast<double>(i);
    all.emplace_back(columns[i].first, [rate](double t_s) { return 0.5 * std::sin(rate * t_s); });
    all.emplace_back(columns[i].second, [rate](double t_s) { return std::cos(rate * t_s); });
  }
  return table_of(all);
}

TEST(Guess, BindsJointsByTheirNamesWhateverTheirOrder) {
  const std::vector<std::string> shapes = {
      "j{}", "joint{}", "axis{}", "panda_joint{}", "link_{}_j", "left_arm_{}", "shoulder_{}"};
  for (const std::string& shape : shapes) {
    const auto name = [&](int n) { return fmt::format(fmt::runtime(shape), n); };
    std::vector<std::pair<std::string, std::string>> columns;
    for (const int n : {3, 1, 2})
      columns.emplace_back(name(n) + "_pos_rad", "/robot/" + name(n) + "/effort");
    const record::Table table = joints_table(columns);
    const auto guess = guess_profile(table, {name(1), name(2), name(3), name(4)});
    ASSERT_TRUE(guess.ok()) << guess.error().message;
    for (const int n : {1, 2, 3}) {
      EXPECT_EQ(channel_of(*guess, table, name(n) + "_pos_rad").joint, name(n));
      EXPECT_EQ(channel_of(*guess, table, "/robot/" + name(n) + "/effort").joint, name(n));
    }
    EXPECT_FALSE(asks(*guess, "joints of the plant")) << shape;
  }
}

TEST(Guess, TakesNumbersFromZeroInThePlantsOrderAndAsks) {
  const std::vector<std::string> arm = {"shoulder_pan", "shoulder_lift", "elbow",
                                        "wrist_1",      "wrist_2",       "wrist_3"};
  for (const int first : {0, 1}) {
    std::vector<std::pair<std::string, std::string>> columns;
    for (int n = 0; n < 6; ++n)
      columns.emplace_back(fmt::format("q{}_rad", n + first), fmt::format("tau_J{}", n + first));
    const record::Table table = joints_table(columns);
    for (const auto& joints :
         {arm, std::vector<std::string>{"a_1", "a_2", "a_3", "a_4", "a_5", "a_6"}}) {
      const auto guess = guess_profile(table, joints);
      ASSERT_TRUE(guess.ok()) << guess.error().message;
      for (std::size_t n = 0; n < 6; ++n) {
        EXPECT_EQ(channel_of(*guess, table, columns[n].first).joint, joints[n]);
        EXPECT_EQ(channel_of(*guess, table, columns[n].second).joint, joints[n]);
      }
      EXPECT_EQ(asks(*guess, fmt::format("{} = {}", first, joints[0])),
                first == 0 || joints == arm);
    }
  }
}

TEST(Guess, LeavesOpenWhatNeitherWordsNorNumbersDecide) {
  const record::Table table =
      joints_table({{"wrist_pos_rad", "wrist_tau"}, {"7_pos_rad", "7_tau"}});
  const auto guess = guess_profile(table, {"wrist_1", "wrist_2", "elbow"});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "wrist_pos_rad").joint, "wrist");
  EXPECT_TRUE(
      asks(*guess, "the plant has no joint for: wrist, 7; free are: wrist_1, wrist_2, elbow"));
}

TEST(Guess, TellsADesiredPositionFromADerivativeByTheValues) {
  const Signal late = [](double t_s) { return motion(t_s + 0.1); };
  const record::Table table =
      table_of({{"t_s", kTime},
                {"actual_q_0", motion},
                {"actual_qd_0", velocity},
                {"target_qd_0", [](double t_s) { return velocity(t_s + 0.1); }},
                {"q_d_0", late},
                {"torque_0", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "actual_q_0").role, "motor_position");
  EXPECT_EQ(channel_of(*guess, table, "actual_qd_0").role, "motor_velocity");
  EXPECT_EQ(channel_of(*guess, table, "target_qd_0").role, "desired_velocity");
  EXPECT_EQ(channel_of(*guess, table, "q_d_0").role, "desired_position");
}

TEST(Guess, KeepsACommandWithItsOwnJointWhereAllMoveAlike) {
  const record::Table table = table_of({{"t_s", kTime},
                                        {"theta1", motion},
                                        {"theta2", times(0.5, motion)},
                                        {"goal_1", times(0.5, motion)},
                                        {"goal_2", motion},
                                        {"tau1", effort},
                                        {"tau2", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  EXPECT_EQ(channel_of(*guess, table, "goal_1").joint, "joint1");
  EXPECT_EQ(channel_of(*guess, table, "goal_2").joint, "joint2");
}

TEST(Guess, ReadsASecondEncoderAsTheTruth) {
  const record::Table table = table_of({{"t_s", kTime},
                                        {"J1_pos_deg", times(57.0, motion)},
                                        {"J1_joint_encoder_deg", times(57.3, motion)},
                                        {"J1_torque_Nm", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_TRUE(guess.ok()) << guess.error().message;
  std::vector<std::string> roles;
  for (const GuessedChannel& channel : guess->channels)
    roles.push_back(table.columns[channel.column].name + " " + channel.role);
  EXPECT_EQ(roles, (std::vector<std::string>{
                       "J1_pos_deg joint_estimate", "J1_pos_deg motor_position",
                       "J1_joint_encoder_deg joint_truth", "J1_torque_Nm drive_torque"}));
}

TEST(Guess, AsksOnceHoweverManyColumnsADoubtHas) {
  const Signal absolute = [](double t_s) { return t_s < 0.5 ? 0.0 : std::abs(effort(t_s)); };
  const record::Table table = table_of({{"t_s", kTime},
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
  const record::Table table = table_of({{"t_s", kTime}, {"voltage_V", effort}});
  const auto guess = guess_profile(table, {});
  ASSERT_FALSE(guess.ok());
  EXPECT_NE(guess.error().message.find("run.csv: no joint has a position"), std::string::npos);
  EXPECT_NE(guess.error().message.find("t_s, voltage_V"), std::string::npos);
}

TEST(Guess, WritesAProfileThatReadsTheTable) {
  const record::Table table = table_of({{"t_ms", times(1e3, kTime)},
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
