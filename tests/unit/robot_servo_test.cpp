// SPDX-License-Identifier: Apache-2.0
//
// Position servos, of which goal and present position were recorded and no effort: MuJoCo moves an
// arm of two, with encoders of 12 bits, and `ravencal diagnose` compares it with the arm's model.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "core/whole_file.hpp"
#include "physics/mujoco_model.hpp"
#include "unit/run_command.hpp"

namespace ravencal {
namespace {

namespace fs = std::filesystem;

constexpr int kServos = 2;
constexpr std::array<const char*, kServos> kServoNames = {"shoulder", "elbow"};
constexpr double kFriction_n_m = 0.05;
constexpr double kRowPeriod_s = 0.02;

/// What the shoulder has other than its model.
struct Servo {
  double frictionloss_n_m = kFriction_n_m;
  double kp_n_m_per_rad = 18.0;
  int late_rows = 0;  ///< of the present position
};

std::string arm(const Servo& shoulder) {
  return fmt::format(
      R"(<mujoco model="servos">
  <compiler angle="radian"/>
  <option timestep="0.0005" gravity="0 0 -9.81"/>
  <default><joint damping="0.6" armature="0.028"/></default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" frictionloss="{}"/>
      <inertial pos="0 0 0.06" mass="0.15" diaginertia="0.0003 0.0003 0.0001"/>
      <body name="fore" pos="0 0 0.12">
        <joint name="elbow" axis="0 1 0" frictionloss="{}"/>
        <inertial pos="0 0 0.05" mass="0.1" diaginertia="0.0002 0.0002 0.0001"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general joint="shoulder" biastype="affine" gainprm="{}" biasprm="0 -{} -0.5"/>
    <general joint="elbow" biastype="affine" gainprm="18" biasprm="0 -18 -0.5"/>
  </actuator>
</mujoco>)",
      shoulder.frictionloss_n_m, kFriction_n_m, shoulder.kp_n_m_per_rad, shoulder.kp_n_m_per_rad);
}

/// Four sines of each joint, of amplitudes, frequencies and phases that the seed draws.
class Goals {
 public:
  explicit Goals(unsigned seed) {
    std::mt19937 random(seed);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (auto& joint : waves_)
      for (auto& wave : joint) {
        const double amplitude_rad = 0.08 + 0.2 * uniform();
        const double frequency_hz = 0.05 + 0.4 * uniform();
        wave = {amplitude_rad, frequency_hz, 2.0 * M_PI * uniform()};
      }
  }

  [[nodiscard]] double at(double t_s, int joint) const {
    double sum = 0.0;
    for (const auto& [amplitude_rad, frequency_hz, phase] :
         waves_.at(static_cast<std::size_t>(joint)))
      sum += amplitude_rad * std::sin(2.0 * M_PI * frequency_hz * t_s + phase);
    return sum;
  }

 private:
  std::array<std::array<std::array<double, 3>, 4>, kServos> waves_{};
};

class RobotServo : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "arm.xml") << arm({});
    std::string profile = "[source]\nrobot = \"servos\"\nformat = \"csv\"\ntime = \"t_s\"\n";
    for (const char* joint : kServoNames)
      for (const auto& [role, column] :
           {std::pair{"desired_position", "goal"}, std::pair{"joint_estimate", "present"}})
        profile += fmt::format(
            "\n[[channel]]\nname = \"{1}.{0}\"\ncolumn = \"{1}_{0}\"\nunit = \"rad\"\n"
            "role = \"{2}\"\njoint = \"{0}\"\n",
            joint, column, role);
    std::ofstream(folder_ / "profile.toml") << profile;
  }
  void TearDown() override { fs::remove_all(folder_); }

  void record(const Servo& shoulder, const char* name, unsigned seed, double duration_s) const {
    const auto compiled = physics::compile_model(arm(shoulder), "real.xml");
    ASSERT_TRUE(compiled.model) << compiled.refusal;
    const mjModel& model = *compiled.model;
    const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(&model),
                                                                 &mj_deleteData);
    const Goals goals(seed);
    const auto steps = static_cast<int>(std::lround(kRowPeriod_s / model.opt.timestep));
    const int rows = static_cast<int>(duration_s / kRowPeriod_s);
    const double count_rad = 2.0 * M_PI / 4096.0;
    for (int j = 0; j < kServos; ++j) data->qpos[j] = goals.at(0.0, j);
    std::vector<std::array<double, kServos>> present;
    std::ofstream file(folder_ / name);
    file << "t_s,goal_shoulder,present_shoulder,goal_elbow,present_elbow\n";
    for (int row = 0; row < rows; ++row) {
      present.emplace_back();
      for (int j = 0; j < kServos; ++j)
        present.back().at(static_cast<std::size_t>(j)) =
            count_rad * std::round(data->qpos[j] / count_rad);
      const auto seen = static_cast<std::size_t>(std::max(0, row - shoulder.late_rows));
      file << fmt::format("{},{},{},{},{}\n", data->time, goals.at(data->time, 0), present[seen][0],
                          goals.at(data->time, 1), present.back()[1]);
      for (int step = 0; step < steps; ++step) {
        for (int j = 0; j < kServos; ++j) data->ctrl[j] = goals.at(data->time, j);
        mj_step(&model, data.get());
      }
    }
  }

  [[nodiscard]] nlohmann::json diagnosed(const Servo& shoulder) const {
    record(shoulder, "train.csv", 1, 60.0);
    record(shoulder, "held_out.csv", 2, 40.0);
    const test::Outcome outcome = test::run_command(
        fmt::format("cd {0} && {1} plant from arm.xml --out plant.toml 2>&1 && {1} diagnose "
                    "train.csv --held-out held_out.csv --profile profile.toml --plant plant.toml "
                    "--out why --placebo 0 2>&1",
                    folder_.string(), RAVENCAL_PROGRAM));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    return nlohmann::json::parse(std::ifstream(folder_ / "why/report.json"));
  }

  /// The one parameter of the one effect that is named, which must be this one of the shoulder.
  [[nodiscard]] static nlohmann::json only_named(const nlohmann::json& report,
                                                 const std::string& id) {
    EXPECT_EQ(report["effects"].size(), 1U) << report["verdict"]["text"];
    if (report["effects"].empty()) return {};
    const nlohmann::json& effect = report["effects"][0];
    EXPECT_EQ(effect["id"], id);
    EXPECT_EQ(effect["joint"], "shoulder");
    return effect["parameters"][0];
  }

  static void expect_holds(const nlohmann::json& parameter, double truth) {
    ASSERT_FALSE(parameter.is_null());
    EXPECT_LE(parameter["ci95"][0].get<double>(), truth);
    EXPECT_GE(parameter["ci95"][1].get<double>(), truth);
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("robot_servo_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(RobotServo, OfTheRightModelLacksNothing) {
  const nlohmann::json report = diagnosed({});
  EXPECT_EQ(report["verdict"]["kind"], "nothing_left_out") << report["verdict"]["text"];
  EXPECT_EQ(core::read_whole_file((folder_ / "plant.toml").string()).value(),
            core::read_whole_file((folder_ / "why/plant_improved.toml").string()).value());
  for (const nlohmann::json& figure : report["held_out"]) {
    EXPECT_EQ(figure["metric"], "tracking_rmse");
    EXPECT_LT(figure["before"].get<double>(), 0.5 * 2.0 * M_PI / 4096.0);
  }
}

TEST_F(RobotServo, ShowsFrictionThatItsModelHasTooLittleOf) {
  const nlohmann::json report = diagnosed({.frictionloss_n_m = 3.0 * kFriction_n_m});
  expect_holds(only_named(report, "coulomb_friction"), 3.0 * kFriction_n_m);
}

TEST_F(RobotServo, ShowsAGainThatItsModelHasTooMuchOf) {
  const nlohmann::json report = diagnosed({.kp_n_m_per_rad = 12.0});
  expect_holds(only_named(report, "controller_gain"), 12.0 / 18.0 - 1.0);
}

TEST_F(RobotServo, ShowsHowLateItIsSeen) {
  const nlohmann::json report = diagnosed({.late_rows = 2});
  expect_holds(only_named(report, "delay"), 2.0 * kRowPeriod_s);
}

}  // namespace
}  // namespace ravencal
