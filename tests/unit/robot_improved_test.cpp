// SPDX-License-Identifier: Apache-2.0
//
// Models out: MuJoCo moves a robot that differs from its model, `ravencal diagnose` compares, and
// MuJoCo alone finds in the model that was written what the report states.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "core/whole_file.hpp"
#include "physics/mujoco_model.hpp"
#include "physics/predict/smoother.hpp"
#include "unit/run_command.hpp"

namespace ravencal {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::VectorXd;
using physics::ModelPointer;

/// What the robot has beyond its model, by joint.
struct Concealed {
  double frictionloss = 0.0, damping = 0.0, armature = 0.0, mass = 0.0;
};

std::string arm(const Concealed& shoulder, const Concealed& elbow) {
  return fmt::format(
      R"(<mujoco model="arm">
  <compiler angle="radian"/>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <!-- my arm -->
  <default><joint damping="0.05" armature="0.02"/></default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" frictionloss="{}" damping="{}" armature="{}"/>
      <inertial pos="0 0 -0.15" mass="{}" diaginertia="0.01 0.01 0.001"/>
      <body name="fore" pos="0 0 -0.3">
        <joint name="elbow" axis="0 1 0" frictionloss="{}" damping="{}" armature="{}"/>
        <inertial pos="0 0 -0.1" mass="{}" diaginertia="0.003 0.003 0.0005"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="m1" joint="shoulder"/><motor name="m2" joint="elbow" gear="2"/></actuator>
</mujoco>)",
      0.1 + shoulder.frictionloss, 0.05 + shoulder.damping, 0.02 + shoulder.armature,
      1.0 + shoulder.mass, 0.05 + elbow.frictionloss, 0.05 + elbow.damping, 0.02 + elbow.armature,
      0.5 + elbow.mass);
}

constexpr Index kJoints = 2;
/// Below, what MuJoCo's friction does depends on the acceleration, which no encoder shows.
constexpr double kMoves_rad_per_s = 0.05;
/// Of the efforts' RMS: the report counts slower rows as well.
constexpr double kSameError_percent = 1.5;

/// Rows of a recording: [rows][joints].
struct Recorded {
  VectorXd t_s;
  Eigen::MatrixXd position_rad, effort_n_m;  ///< of the drives
  Eigen::MatrixXd truth_rad;                 ///< of the links
};

/// Sums of sines of other periods for each seed.
double desired_rad(double t_s, Index joint, double seed) {
  const double slow = 0.11 + 0.015 * seed + 0.04 * static_cast<double>(joint);
  return 0.7 * std::sin(2.0 * M_PI * slow * t_s) +
         0.4 * std::sin(2.0 * M_PI * 1.7 * slow * t_s + seed);
}

/// Places of the drives' joints; all joints are hinges, so that they count states, too.
std::array<Index, kJoints> drives_of(const mjModel& model) {
  return {mj_name2id(&model, mjOBJ_JOINT, "shoulder"), mj_name2id(&model, mjOBJ_JOINT, "elbow")};
}

Recorded record(const mjModel& model, double seed, double duration_s) {
  constexpr double kRowPeriod_s = 0.01, kInstant_s = 1e-4;
  constexpr double kEncoder_rad = 2e-5, kTorque_n_m = 5e-3;
  std::mt19937 random(static_cast<unsigned>(seed * 100.0));
  std::normal_distribution<double> normal;
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(&model), &mj_deleteData);
  const auto rows = static_cast<Index>(duration_s / kRowPeriod_s);
  const auto steps = static_cast<int>(std::lround(kRowPeriod_s / model.opt.timestep));
  const Eigen::MatrixXd empty(rows, kJoints);
  Recorded out{VectorXd(rows), empty, empty, empty};
  const std::array<Index, kJoints> drives = drives_of(model);
  for (Index j = 0; j < kJoints; ++j) {
    const Index at = drives.at(static_cast<std::size_t>(j));
    data->qpos[at] = desired_rad(0.0, j, seed);
    data->qvel[at] = (desired_rad(kInstant_s, j, seed) - data->qpos[at]) / kInstant_s;
  }
  for (Index step = 0; step < rows * steps; ++step) {
    for (Index j = 0; j < kJoints; ++j) {
      const Index at = drives.at(static_cast<std::size_t>(j));
      const double asked =
          60.0 * (desired_rad(data->time, j, seed) - data->qpos[at]) - 3.0 * data->qvel[at];
      data->ctrl[j] = asked / model.actuator_gear[6 * j];
    }
    if (step % steps == 0) {
      mj_forward(&model, data.get());
      const Index row = step / steps;
      out.t_s[row] = data->time;
      for (Index j = 0; j < kJoints; ++j) {
        const Index at = drives.at(static_cast<std::size_t>(j));
        // Behind the drive's joint come those that a gap or a cable moves.
        const Index end = j + 1 < kJoints ? drives.back() : model.njnt;
        const double link_rad = Eigen::Map<VectorXd>(data->qpos + at, end - at).sum();
        out.position_rad(row, j) = data->qpos[at] + kEncoder_rad * normal(random);
        out.truth_rad(row, j) = link_rad + kEncoder_rad * normal(random);
        out.effort_n_m(row, j) = data->qfrc_actuator[at] + kTorque_n_m * normal(random);
      }
    }
    mj_step(&model, data.get());
  }
  return out;
}

/// Effort that the model's actuator is asked for where it gives `force`, in units of `given`'s.
double asked_n_m(const mjModel& model, const mjModel& given, Index actuator, double force) {
  const double bias = model.actuator_biasprm[mjNBIAS * actuator];
  const double control = (force / model.actuator_gear[6 * actuator] - bias) /
                         model.actuator_gainprm[mjNGAIN * actuator];
  return control * given.actuator_gainprm[mjNGAIN * actuator] * given.actuator_gear[6 * actuator];
}

/// What a model's inverse dynamics leave of the recorded efforts, of these: RMS in per cent,
/// [joints].
VectorXd effort_error(const mjModel& model, const mjModel& given, const Recorded& recorded) {
  const std::vector<char> fresh(static_cast<std::size_t>(recorded.t_s.size()), 0);
  std::vector<physics::Motion> motions;
  for (Index j = 0; j < kJoints; ++j)
    motions.push_back(physics::smooth_motion(recorded.t_s, recorded.position_rad.col(j), fresh));
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(&model), &mj_deleteData);
  VectorXd squares = VectorXd::Zero(kJoints), whole = squares;
  for (Index row = 0; row < recorded.t_s.size(); ++row) {
    for (Index j = 0; j < kJoints; ++j) {
      const physics::Motion& motion = motions[static_cast<std::size_t>(j)];
      data->qpos[j] = motion.q[row];
      data->qvel[j] = motion.v[row];
      data->qacc[j] = motion.a[row];
    }
    mj_inverse(&model, data.get());
    for (Index j = 0; j < kJoints; ++j) {
      if (std::abs(data->qvel[j]) < kMoves_rad_per_s) continue;
      const double recorded_n_m = recorded.effort_n_m(row, j);
      squares[j] += std::pow(recorded_n_m - asked_n_m(model, given, j, data->qfrc_inverse[j]), 2);
      whole[j] += std::pow(recorded_n_m, 2);
    }
  }
  return 100.0 * (squares.array() / whole.array()).sqrt();
}

ModelPointer loaded(const fs::path& path) {
  std::array<char, 1000> error{};
  ModelPointer model(
      mj_loadXML(path.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
  EXPECT_TRUE(model) << error.data();
  return model;
}

class RobotImproved : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "arm.xml") << arm({}, {});
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const char* name, const Recorded& r) const {
    std::ofstream file(folder_ / name);
    file
        << "t_s,shoulder_rad,shoulder_n_m,shoulder_truth_rad,elbow_rad,elbow_n_m,elbow_truth_rad\n";
    for (Index i = 0; i < r.t_s.size(); ++i) {
      file << r.t_s[i];
      for (Index j = 0; j < kJoints; ++j)
        file << fmt::format(",{},{},{}", r.position_rad(i, j), r.effort_n_m(i, j),
                            r.truth_rad(i, j));
      file << "\n";
    }
  }

  /// Moves the robot twice and writes both motions; the held-out one.
  [[nodiscard]] Recorded held_out_of(const std::string& robot) const {
    const auto real = physics::compile_model(robot, "real.xml");
    EXPECT_TRUE(real.model) << real.refusal;
    write("train.csv", record(*real.model, 1.0, 60.0));
    const Recorded held_out = record(*real.model, 2.0, 40.0);
    write("held_out.csv", held_out);
    return held_out;
  }

  /// report.json of the arm's model as the plant; `with_truth`: the joints' own encoders count.
  [[nodiscard]] nlohmann::json diagnose(bool with_truth) const {
    std::string profile = "[source]\nrobot = \"arm\"\nformat = \"csv\"\ntime = \"t_s\"\n";
    for (const char* joint : {"shoulder", "elbow"})
      for (const auto& [role, suffix, unit] :
           {std::tuple{"motor_position", "rad", "rad"}, std::tuple{"drive_torque", "n_m", "N_m"},
            std::tuple{"joint_truth", "truth_rad", "rad"}})
        if (with_truth || std::string_view(role) != "joint_truth")
          profile += fmt::format(
              "\n[[channel]]\nname = \"{0}.{1}\"\ncolumn = \"{0}_{2}\"\nunit = \"{3}\"\nrole = "
              "\"{1}\"\njoint = \"{0}\"\n",
              joint, role, suffix, unit);
    std::ofstream(folder_ / "profile.toml") << profile;
    const test::Outcome outcome = test::run_command(fmt::format(
        "cd {} && {} diagnose train.csv --held-out held_out.csv --profile profile.toml --plant "
        "arm.xml --out why --placebo 0 2>&1",
        folder_.string(), RAVENCAL_PROGRAM));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    EXPECT_TRUE(outcome.text.find("why/robot_improved.xml: ") != std::string::npos) << outcome.text;
    const auto report = nlohmann::json::parse(std::ifstream(folder_ / "why/report.json"));
    EXPECT_TRUE(report["verdict"]["text"].get<std::string>().find(
                    "robot_improved.xml is arm.xml with") != std::string::npos);
    return report;
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("robot_improved_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(RobotImproved, HasInMujocoAloneTheEffortErrorThatTheReportStates) {
  const Recorded held_out = held_out_of(arm({0.4, 0.3, 0.005, 0.0}, {0.3, 0.2, 0.0, 0.2}));
  const nlohmann::json report = diagnose(false);
  const ModelPointer given = loaded(folder_ / "arm.xml");
  const ModelPointer improved = loaded(folder_ / "why/robot_improved.xml");
  ASSERT_TRUE(given && improved);
  const VectorXd before = effort_error(*given, *given, held_out);
  const VectorXd after = effort_error(*improved, *given, held_out);
  int compared = 0;
  for (const auto& figure : report["held_out"]) {
    if (figure["metric"] != "effort_relative_error_unfiltered") continue;
    const Index j = figure["joint"] == "shoulder" ? 0 : 1;
    EXPECT_NEAR(before[j], figure["before"].get<double>(), kSameError_percent) << j;
    EXPECT_NEAR(after[j], figure["after"].get<double>(), kSameError_percent) << j;
    EXPECT_LT(after[j], 0.2 * before[j]) << j;
    ++compared;
  }
  EXPECT_EQ(compared, kJoints);

  const auto write_again = [this] {
    return test::run_command(
        fmt::format("cd {} && {} plant to why/plant_improved.toml --model arm.xml --out "
                    "robot_improved.xml 2>&1",
                    folder_.string(), RAVENCAL_PROGRAM));
  };
  const test::Outcome again = write_again();
  EXPECT_EQ(again.exit_code, 0) << again.text;
  EXPECT_NE(again.text.find("shoulder: frictionloss 0.1 -> "), std::string::npos) << again.text;
  EXPECT_EQ(*core::read_whole_file(folder_ / "robot_improved.xml"),
            *core::read_whole_file(folder_ / "why/robot_improved.xml"));
  const test::Outcome exists = write_again();
  EXPECT_EQ(exists.exit_code, 2) << exists.text;
  EXPECT_NE(exists.text.find("--force"), std::string::npos) << exists.text;
}

/// The robot has its gap on a body of its own, as nothing that this project writes.
std::string arm_with_gap(double half_width_rad) {
  std::string text = arm({}, {});
  const std::string_view inertial = "<inertial pos=\"0 0 -0.15\"";
  text.insert(text.find(inertial),
              fmt::format("<inertial pos=\"0 0 0\" mass=\"1e-4\" diaginertia=\"1e-6 1e-6 1e-6\"/>"
                          "<body><joint name=\"gap\" axis=\"0 1 0\" damping=\"0\" armature=\"0\" "
                          "limited=\"true\" range=\"-{0} {0}\" solreflimit=\"0.002 1\"/>",
                          half_width_rad));
  text.insert(text.find("</worldbody>"), "</body>");
  return text;
}

/// RMS of the link's position where a model moves by itself as the robot was commanded.
double position_error_rad(const mjModel& model, const Recorded& recorded, double seed) {
  const Recorded moved = record(model, seed, 40.0);
  return std::sqrt((moved.truth_rad.col(0) - recorded.truth_rad.col(0)).squaredNorm() /
                   static_cast<double>(recorded.t_s.size()));
}

TEST_F(RobotImproved, MovesByItselfWithTheGapOfTheRobot) {
  constexpr double kHalfWidth_rad = 0.003;
  const Recorded held_out = held_out_of(arm_with_gap(kHalfWidth_rad));
  const nlohmann::json report = diagnose(true);
  const ModelPointer given = loaded(folder_ / "arm.xml");
  const ModelPointer improved = loaded(folder_ / "why/robot_improved.xml");
  ASSERT_TRUE(given && improved);
  const double before_rad = position_error_rad(*given, held_out, 2.0);
  const double after_rad = position_error_rad(*improved, held_out, 2.0);
  EXPECT_LT(after_rad, 0.1 * before_rad);
  int compared = 0;
  for (const auto& figure : report["held_out"]) {
    if (figure["metric"] != "position_rmse" || figure["joint"] != "shoulder") continue;
    EXPECT_NEAR(before_rad, figure["before"].get<double>(), 0.1 * before_rad);
    // The prediction crosses a gap at once, the link in the time that its weight needs.
    EXPECT_LT(after_rad, figure["after"].get<double>());
    ++compared;
  }
  EXPECT_EQ(compared, 1);
}

}  // namespace
}  // namespace ravencal
