// SPDX-License-Identifier: Apache-2.0
//
// What the names of columns say, and which joint of a plant they mean.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "guess/column_name.hpp"
#include "unit/guess_tables.hpp"

namespace ravencal::guess {
namespace {

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

TEST(Guess, MatchesThePlantsJointsByWordsThenByOrder) {
  const Signal b = [](double t_s) { return 0.5 * std::sin(0.9 * t_s); };
  const Signal c = [](double t_s) { return 0.4 * std::sin(2.9 * t_s); };
  const record::Table table = table_of({{"t_s", kSeconds},
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
  std::vector<std::pair<std::string, Signal>> all = {{"t_s", kSeconds}};
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
      table_of({{"t_s", kSeconds},
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
  const record::Table table = table_of({{"t_s", kSeconds},
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
  const record::Table table = table_of({{"t_s", kSeconds},
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

}  // namespace
}  // namespace ravencal::guess
