// SPDX-License-Identifier: Apache-2.0
//
// Positions that start again after a turn: from the guess to the imported recording.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/whole_file.hpp"
#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "guess/guess.hpp"
#include "guess/wrap_width.hpp"
#include "unit/guess_tables.hpp"
#include "unit/record/scratch.hpp"

namespace ravencal::guess {
namespace {

/// One joint that turns several times to and fro, in rad.
double turning(double t_s) { return 2.9 + 9.0 * std::sin(0.45 * t_s) + 0.7 * std::sin(2.3 * t_s); }
double turning_rad_s(double t_s) {
  return 9.0 * 0.45 * std::cos(0.45 * t_s) + 0.7 * 2.3 * std::cos(2.3 * t_s);
}
double turning_effort(double t_s) {
  const double v = turning_rad_s(t_s);
  const double a =
      -9.0 * 0.45 * 0.45 * std::sin(0.45 * t_s) - 0.7 * 2.3 * 2.3 * std::sin(2.3 * t_s);
  return 0.05 * a + 0.09 * v + 0.3 * ((v > 0.0) - (v < 0.0));
}
double into(double value, double lowest, double width) {
  return value - width * std::floor((value - lowest) / width);
}

/// An encoder: a turn is `per_turn` of the file, which starts again at `lowest` + `width`.
struct Encoder {
  const char* name;
  const char* goal_name;
  double per_turn;
  double width;
  double lowest;
  int digits;
  [[nodiscard]] std::string text(double rad) const {
    double value = rad * per_turn / kTurnRad;
    if (digits == 0) value = std::floor(value);
    return fmt::format("{:.{}f}", into(value, lowest, width), digits);
  }
};

/// Writes tables, guesses their profiles and imports them.
class Wraps : public ::testing::Test {
 protected:
  record::Recording imported(const std::string& text) {
    EXPECT_TRUE(core::write_whole_file(scratch_ / "run.csv", text).ok());
    const auto table = exchange::read_table(scratch_ / "run.csv", {});
    EXPECT_TRUE(table.ok());
    const auto guess = guess_profile(*table, {});
    EXPECT_TRUE(guess.ok()) << guess.error().message;
    if (!guess.ok()) return {};
    guess_ = *guess;
    profile_ = profile_text(*guess, *table);
    EXPECT_TRUE(core::write_whole_file(scratch_ / "run.toml", profile_).ok());
    record::LoadOptions options;
    options.profile = (scratch_ / "run.toml").string();
    auto recording = exchange::load_recording((scratch_ / "run.csv").string(), options);
    EXPECT_TRUE(recording.ok()) << recording.error().message << profile_;
    return recording.ok() ? std::move(*recording) : record::Recording();
  }
  [[nodiscard]] const GuessedChannel* channel(std::string_view role) const {
    const auto it = std::find_if(guess_.channels.begin(), guess_.channels.end(),
                                 [&](const auto& c) { return c.role == role; });
    return it == guess_.channels.end() ? nullptr : &*it;
  }

  record::testing::Scratch scratch_;
  Guess guess_;
  std::string profile_;
};

TEST_F(Wraps, AnyCounterIsUnwrappedAndSaid) {
  const Encoder encoders[] = {
      {"elbow_pos_deg", "elbow_cmd_deg", 360.0, 360.0, -180.0, 4},
      {"elbow_pos_deg", "elbow_cmd_deg", 360.0, 360.0, 0.0, 2},
      {"elbow_pos", "elbow_pos_cmd", 360.0, 360.0, 0.0, 3},
      {"elbow_pos_rad", "elbow_cmd_rad", kTurnRad, kTurnRad, -std::numbers::pi, 5},
      {"elbow_pos", "elbow_pos_cmd", kTurnRad, kTurnRad, 0.0, 6},
      {"elbow.pos", "elbow.goal", 1024.0, 1024.0, 0.0, 0},
      {"elbow.pos", "elbow.goal", 16384.0, 16384.0, -8192.0, 0},
      {"elbow_pos_ticks", "elbow_goal_ticks", 1048576.0, 1048576.0, 0.0, 0},
      {"elbow_pos_counts", "elbow_cmd_counts", 2400.0, 2400.0, 0.0, 0},
      {"elbow_pos_raw", "elbow_cmd_raw", 5000.0, 5000.0, 0.0, 0},
      {"elbow_pos_counts", "elbow_cmd_counts", 40000.0, 65536.0, -32768.0, 0},
      {"elbow_pos", "elbow_pos_cmd", 1.0, 1.0, 0.0, 6},
      {"elbow_pos_rad", "elbow_cmd_rad", kTurnRad, kTurnRad / 3.0, 0.0, 6},
  };
  for (const Encoder& encoder : encoders) {
    std::string text =
        fmt::format("t_s,{},elbow_vel_rad_s,elbow_torque_Nm,{}\n", encoder.name, encoder.goal_name);
    for (int row = 0; row < 4000; ++row) {
      const double t_s = 0.01 * row;
      text +=
          fmt::format("{:.3f},{},{:.5f},{:.5f},{}\n", t_s, encoder.text(turning(t_s)),
                      turning_rad_s(t_s), turning_effort(t_s), encoder.text(turning(t_s + 0.02)));
    }
    const record::Recording recording = imported(text);
    const std::string about = fmt::format("{} at {}\n", encoder.name, encoder.width) + profile_;
    ASSERT_NE(channel("motor_position"), nullptr) << about;
    ASSERT_NE(channel("desired_position"), nullptr) << about;
    ASSERT_NE(channel("drive_torque"), nullptr) << about;
    ASSERT_NE(channel("motor_velocity"), nullptr) << about;
    EXPECT_NEAR(channel("motor_position")->wraps_at, encoder.width, 1e-9 * encoder.width) << about;
    EXPECT_EQ(channel("desired_position")->wraps_at, channel("motor_position")->wraps_at) << about;
    EXPECT_EQ(channel("drive_torque")->scale, 1.0) << about;
    EXPECT_EQ(channel("motor_velocity")->scale, 1.0) << about;
    EXPECT_NE(channel("motor_position")->because.find("wraps at"), std::string::npos);
    const auto unwrapped =
        std::count_if(recording.events.begin(), recording.events.end(),
                      [](const record::Event& event) { return event.kind == "unwrapped"; });
    EXPECT_EQ(unwrapped, 2) << about;
    for (const record::Role role : {record::Role::kMotorPosition, record::Role::kDesiredPosition}) {
      const auto column = recording.column(role, "elbow");
      ASSERT_TRUE(column) << about;
      const double late_s = role == record::Role::kMotorPosition ? 0.0 : 0.02;
      // A scale that a velocity tells is right to a few parts in a thousand.
      const double tolerance = encoder.per_turn == encoder.width || encoder.digits > 0 ? 0.01 : 0.1;
      for (int row = 0; row < 4000; ++row)
        ASSERT_NEAR(recording.samples(row, *column) - recording.samples(0, *column),
                    turning(0.01 * row + late_s) - turning(late_s), tolerance)
            << about << row;
    }
  }
}

TEST_F(Wraps, LostRowsWildValuesAndTheSeamDoNoHarm) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::string text = "t_s,hip_pos_deg,hip_torque_Nm\n";
  std::vector<double> truth;
  std::vector<bool> wild;
  for (int row = 0; row < 3000; ++row) {
    const double t_s = 0.01 * row;
    if (uniform(random) < 0.05) continue;
    wild.push_back(row == 700 || row == 1900);
    truth.push_back(turning(t_s));
    const double deg = into(turning(t_s) * 180.0 / std::numbers::pi, -180.0, 360.0);
    text += fmt::format("{:.3f},{},{:.5f}\n", t_s,
                        row == 700    ? "99999"
                        : row == 1900 ? fmt::format("{}", deg > 0.0 ? deg - 177.0 : deg + 183.0)
                        : uniform(random) < 0.02 ? ""
                                                 : fmt::format("{:.4f}", deg),
                        turning_effort(t_s));
  }
  const record::Recording recording = imported(text);
  ASSERT_NE(channel("motor_position"), nullptr) << profile_;
  EXPECT_EQ(channel("motor_position")->wraps_at, 360.0) << profile_;
  const auto column = *recording.column(record::Role::kMotorPosition, "hip");
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const auto at = static_cast<std::size_t>(row);
    if (std::isnan(recording.samples(row, column)) || wild[at]) continue;
    ASSERT_NEAR(recording.samples(row, column) - recording.samples(0, column), truth[at] - truth[0],
                1e-3)
        << row;
  }
}

TEST_F(Wraps, NoiseAtTheSeamIsNoMotion) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> noise(0.0, 0.05);
  std::string text = "t_s,hip_pos_deg,hip_torque_Nm\n";
  for (int row = 0; row < 2000; ++row) {
    const double deg = 180.0 + 0.6 * std::sin(0.01 * row) + noise(random);
    text += fmt::format("{:.3f},{:.3f},{:.3f}\n", 0.01 * row, into(deg, -180.0, 360.0),
                        std::cos(0.01 * row));
  }
  const record::Recording recording = imported(text);
  ASSERT_NE(channel("motor_position"), nullptr) << profile_;
  EXPECT_EQ(channel("motor_position")->wraps_at, 360.0) << profile_;
  const auto column = *recording.column(record::Role::kMotorPosition, "hip");
  EXPECT_LT((recording.samples.col(column).array() - recording.samples(0, column)).abs().maxCoeff(),
            0.05);
}

TEST_F(Wraps, OtherJointsCountInTheSameUnit) {
  std::string text = "t_s,a.pos,a.goal,a.current_mA,b.pos,b.goal,b.current_mA\n";
  for (int row = 0; row < 3000; ++row) {
    const double t_s = 0.01 * row;
    const double b = 2000.0 + 700.0 * std::sin(0.8 * t_s);
    text += fmt::format("{:.2f},{:.0f},{:.0f},{:.1f},{:.0f},{:.0f},{:.1f}\n", t_s,
                        std::floor(into(turning(t_s) * 4096.0 / kTurnRad, 0.0, 4096.0)),
                        std::floor(into(turning(t_s + 0.02) * 4096.0 / kTurnRad, 0.0, 4096.0)),
                        90.0 * turning_effort(t_s), b,
                        2000.0 + 700.0 * std::sin(0.8 * (t_s + 0.02)), 50.0 * std::cos(0.8 * t_s));
  }
  const record::Recording recording = imported(text);
  for (const GuessedChannel& channel : guess_.channels) {
    if (channel.role != "motor_position" && channel.role != "desired_position") continue;
    EXPECT_EQ(channel.unit, "rad") << channel.name;
    EXPECT_DOUBLE_EQ(channel.scale, kTurnRad / 4096.0) << channel.name;
  }
  const auto b = recording.column(record::Role::kMotorPosition, "b");
  ASSERT_TRUE(b) << profile_;
  EXPECT_NEAR(recording.samples.col(*b).maxCoeff(), 2700.0 * kTurnRad / 4096.0, 2e-3);
}

TEST(WrapWidth, IsNotSeenInMotionThatGoesOn) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto none = [](const char* what, bool whole, std::string_view unit,
                       const std::function<double(int)>& value) {
    Eigen::VectorXd values(3000);
    for (int row = 0; row < 3000; ++row) values[row] = value(row);
    const auto wrap = wrap_of(values, whole, unit);
    EXPECT_FALSE(wrap) << what << " wraps at " << (wrap ? wrap->width : 0.0);
  };
  const auto square = [](int row) { return row / 150 % 2 == 0 ? 1.0 : -1.0; };
  for (const char* unit : {"", "deg", "rad", "counts"}) {
    none("sine", false, unit, [](int row) { return 180.0 * std::sin(0.01 * row); });
    none("fast sine", false, unit, [](int row) { return std::sin(2.0 * row); });
    none("steps", false, unit, [&](int row) { return 179.5 * square(row); });
    none("whole turns", false, unit, [&](int row) { return 180.0 * square(row); });
    none("toggling hand", false, unit,
         [&](int row) { return 0.5 + 0.49 * square(row) + 0.003 * uniform(random); });
    none("hand from end to end", false, unit,
         [&](int row) { return 0.5 + 0.499 * square(row) + 0.001 * uniform(random); });
    none("counts that toggle", true, unit, [&](int row) { return 512.0 + 508.0 * square(row); });
    none("first order", false, unit,
         [&](int row) { return square(row) * (1.0 - 2.0 * std::exp(-0.3 * (row % 150))); });
    none("noise", false, unit, [&](int) { return uniform(random); });
    none("resets", false, unit, [](int row) { return 0.02 * (row % 1300); });
    none("constant", true, unit, [](int) { return 4095.0; });
    none("two values", true, unit, [](int row) { return row == 1500 ? 4095.0 : 0.0; });
  }
}

TEST_F(Wraps, ACommandThatStartsItsRampAgainIsNoCounter) {
  std::string text = "t_s,q_deg,q_cmd_deg,tau_Nm\n";
  double q = 0.0;
  for (int row = 0; row < 4000; ++row) {
    const double ramp = 0.72 * (row % 500);
    const double step = std::clamp(0.2 * (ramp - q), -4.0, 4.0);
    q += step;
    text += fmt::format("{:.2f},{:.4f},{:.4f},{:.4f}\n", 0.01 * row, q, ramp, 0.1 * step);
  }
  imported(text);
  EXPECT_EQ(profile_.find("wraps_at"), std::string::npos) << profile_;
}

}  // namespace
}  // namespace ravencal::guess
