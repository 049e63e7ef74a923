// SPDX-License-Identifier: Apache-2.0
//
// Drives of two plants on their own along recordings of robots that this file integrates.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "diagnose/explain/parts.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using record::Role;

constexpr double kDt_s = 1e-3;
constexpr Index kRunRows = 12'000;
constexpr Index kSettlingRows = 1'000;  ///< of the servo, before the recording begins

constexpr const char* kSlide = R"(
[robot]
name = "slide"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "slide"
kind = "prismatic"
motor_inertia_kg_m2 = 10.0
gearbox_ratio = 1.0
reduction_rad_per_m = 1.0
joint_encoder_resolution_m = 1e-6
  [joint.drive]
  input = "force_n"
)";
constexpr const char* kServo = R"(
  [joint.controller]
  kp_n_m_per_rad = 4000.0
  kd_n_m_s_per_rad = 300.0
  dac_limit_counts = 0.0
)";
constexpr const char* kFriction = R"(
  [[joint.effect]]
  id = "coulomb_friction"
  level_n = 5.0
  [[joint.effect]]
  id = "viscous_friction"
  damping_n_s_per_m = 40.0
)";
constexpr const char* kPendulum = R"(
[robot]
name = "pendulum"
gravity_m_per_s2 = [0.0, -9.8, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "pendulum"
kind = "revolute"
motor_inertia_kg_m2 = 0.02
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-4
  [joint.link]
  mass_kg = 1.0
  com_m = [0.3, 0.0, 0.0]
  inertia_kg_m2 = [0.0, 0.0, 0.0]
)";

physics::Plant plant_of(const std::string& text) {
  auto plant = physics::parse_plant(text, "test.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

/// A body whose servo follows two sines.
struct Robot {
  double inertia = 10.0;
  double kp = 4000.0, kd = 300.0;
  double desired_rate = 0.0;  ///< share of the desired velocity that the servo's damping knows of
  double limit = 1e9;
  double effort_sign = 1.0;  ///< of the recorded effort
  std::function<double(double, double)> resists = [](double, double v) {
    return 5.0 * std::tanh(v / 1e-4) + 40.0 * v;
  };
};

record::Recording recording_of(const Robot& robot, const std::string& joint) {
  record::Recording r;
  r.channels = {{"desired", "", Role::kDesiredPosition, joint},
                {"motor", "rad", Role::kMotorPosition, joint},
                {"effort", "", Role::kDriveTorque, joint}};
  r.samples.setZero(kRunRows, 3);
  r.source = "test";
  double q = 0.0, v = 0.0;
  for (Index i = -kSettlingRows; i < kRunRows; ++i) {
    const double t_s = kDt_s * static_cast<double>(i);
    const double desired = 0.05 * std::sin(2.0 * t_s) + 0.02 * std::sin(5.3 * t_s);
    const double desired_v = 0.1 * std::cos(2.0 * t_s) + 0.106 * std::cos(5.3 * t_s);
    const double asked = robot.kp * (desired - q) + robot.kd * (robot.desired_rate * desired_v - v);
    if (i >= 0) {
      r.t_ns.push_back(std::llround(1e9 * t_s));
      r.samples.row(i) << desired, q, robot.effort_sign * asked;
    }
    for (int k = 0; k < 20; ++k) {
      const double effort = std::clamp(asked, -robot.limit, robot.limit);
      v += kDt_s / 20.0 * (effort - robot.resists(q, v)) / robot.inertia;
      q += kDt_s / 20.0 * v;
    }
  }
  return r;
}

Report report_of(const physics::Plant& given, const physics::Plant& improved,
                 const record::Recording& recording) {
  std::vector<Track> tracks;
  tracks.push_back(*make_track(recording, given, 0.0, 1e9));
  const Likelihood rows(given, std::move(tracks));
  Report report;
  add_free_run(view_of(given, improved, rows, false), given, report);
  return report;
}

const HeldOut& figure(const Report& report, const std::string& metric) {
  static const HeldOut missing;
  const auto it = std::find_if(report.held_out.begin(), report.held_out.end(),
                               [&](const HeldOut& h) { return h.metric == metric; });
  EXPECT_NE(it, report.held_out.end()) << metric;
  return it == report.held_out.end() ? missing : *it;
}

TEST(DiagnoseRun, TellsAPlantWithTheRobotsFrictionFromOneWithout) {
  const auto given = plant_of(std::string(kSlide) + kServo);
  const auto improved = plant_of(std::string(kSlide) + kServo + kFriction);
  const Report report = report_of(given, improved, recording_of({}, "slide"));
  ASSERT_EQ(report.held_out.size(), 3U);
  const HeldOut& free = figure(report, "free_run_1s_rmse");
  EXPECT_EQ(free.joint, "slide");
  EXPECT_EQ(free.unit, "m");
  EXPECT_GT(free.before, 0.05) << "nothing stops the slide";
  EXPECT_LT(free.after, 3e-3);
  EXPECT_LT(free.floor, 1e-6) << "the position was recorded without noise";
  for (const char* metric : {"closed_loop_rmse", "closed_loop_mae"}) {
    EXPECT_GT(figure(report, metric).before, 1e-3);
    EXPECT_LT(figure(report, metric).after, 2e-4) << metric;
  }
}

TEST(DiagnoseRun, GivesTheSameFiguresOfAPlantThatWasWrittenAndRead) {
  const auto given = plant_of(std::string(kSlide) + kServo);
  auto improved = plant_of(std::string(kSlide) + kServo + kFriction);
  improved.joints[0].effects[0].parameters["level"] = 5.0 / 3.0;
  improved.joints[0].effects[1].parameters["damping"] = 40.0 * std::sqrt(2.0);
  const auto recording = recording_of({}, "slide");
  const Report kept = report_of(given, improved, recording);
  const Report read = report_of(given, plant_of(physics::plant_text(improved)), recording);
  ASSERT_EQ(kept.held_out.size(), read.held_out.size());
  for (std::size_t i = 0; i < kept.held_out.size(); ++i) {
    EXPECT_EQ(kept.held_out[i].before, read.held_out[i].before);
    EXPECT_EQ(kept.held_out[i].after, read.held_out[i].after);
  }
}

TEST(DiagnoseRun, DriftsFurtherTheLongerItRuns) {
  const auto given = plant_of(std::string(kSlide) + kServo);
  const auto improved = plant_of(std::string(kSlide) + kServo + kFriction);
  const Report report = report_of(given, improved, recording_of({}, "slide"));
  ASSERT_EQ(report.drift.size(), 4U);
  EXPECT_EQ(report.drift[1].before, figure(report, "free_run_1s_rmse").before);
  for (std::size_t i = 0; i < report.drift.size(); ++i) {
    const Drift& drift = report.drift[i];
    EXPECT_EQ(drift.refitted, drift.before) << drift.horizon_s;  // the same plant
    EXPECT_LT(drift.after, 0.5 * drift.before) << drift.horizon_s;
    if (i > 0 && drift.horizon_s <= 2.0) {  // then it swings back
      EXPECT_GT(drift.before, report.drift[i - 1].before) << drift.horizon_s;
    }
  }
}

TEST(DiagnoseRun, LeavesTheLoopOpenWithoutAController) {
  const auto plant = plant_of(std::string(kSlide) + kFriction);
  const Report report = report_of(plant, plant, recording_of({}, "slide"));
  ASSERT_EQ(report.held_out.size(), 1U);
  EXPECT_EQ(report.held_out[0].metric, "free_run_1s_rmse");
}

TEST(DiagnoseRun, FindsInTheEffortWhetherTheServoKnowsTheDesiredVelocity) {
  const auto plant = plant_of(std::string(kSlide) + kServo + kFriction);
  Robot robot;
  robot.desired_rate = 1.0;
  EXPECT_LT(figure(report_of(plant, plant, recording_of(robot, "slide")), "closed_loop_rmse").after,
            2e-4);
}

TEST(DiagnoseRun, WeighsALonePendulumWhereItRuns) {
  const auto given = plant_of(kPendulum);
  auto improved = given;
  improved.joints[0].link.mass_kg = 1.1;
  Robot robot;
  robot.inertia = 0.02 + 1.1 * 0.09;
  robot.kp = 60.0;
  robot.kd = 5.0;
  robot.resists = [](double q, double) { return 1.1 * 9.8 * 0.3 * std::cos(q); };
  const HeldOut free =
      figure(report_of(given, improved, recording_of(robot, "pendulum")), "free_run_1s_rmse");
  EXPECT_EQ(free.unit, "rad");
  EXPECT_LT(free.after, 5e-3);
  EXPECT_GT(free.before, 10.0 * free.after);
}

TEST(DiagnoseRun, LetsALonePendulumHangAboutWhereItsEffortHoldsIt) {
  std::string hanging = kPendulum;
  hanging.replace(hanging.find("[0.0, -9.8, 0.0]"), 16, "[9.8, 0.0, 0.0]");
  const auto improved = plant_of(hanging);
  const auto given = plant_of(hanging + R"(
  [[joint.effect]]
  id = "effort_offset"
  offset_n_m = 0.3
)");
  Robot robot;
  robot.inertia = 0.02 + 0.09;
  robot.kp = 20.0;
  robot.kd = 2.0;
  robot.resists = [](double q, double) { return 9.8 * 0.3 * std::sin(q); };
  const HeldOut free =
      figure(report_of(given, improved, recording_of(robot, "pendulum")), "free_run_1s_rmse");
  // It swings about 0.1 rad to the side; without its own weight it would be 1.4 rad off after 1 s.
  EXPECT_NEAR(free.before, 0.12, 0.06);
  EXPECT_LT(free.after, 5e-3);
}

/// Motor `joint` along a sine, other motors at rest, with the effort that the plant predicts.
record::Recording predicted_recording(const physics::Plant& plant, const std::string& joint,
                                      double amplitude) {
  constexpr Index kRows = 1000;
  constexpr double kRate = 1.3;  // rad/s
  physics::ForcedMotion forced;
  forced.t_s = Eigen::VectorXd::LinSpaced(kRows, 0.0, 0.02 * static_cast<double>(kRows - 1));
  forced.fresh.assign(kRows, 0);
  forced.fresh.front() = 1;
  const Eigen::ArrayXd phase = kRate * forced.t_s.array();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(kRows);
  for (const physics::Joint& other : plant.joints)
    forced.motors.push_back(other.name == joint
                                ? physics::Motion{amplitude * phase.sin(),
                                                  amplitude * kRate * phase.cos(),
                                                  -amplitude * kRate * kRate * phase.sin()}
                                : physics::Motion{zero, zero, zero});
  const auto predicted = physics::predict(plant, forced);
  EXPECT_TRUE(predicted.ok());
  record::Recording r;
  r.source = "test";
  for (Index i = 0; i < kRows; ++i) r.t_ns.push_back(20'000'000 * i);
  r.samples.resize(kRows, static_cast<Index>(plant.joints.size() + 1));
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const std::string& name = plant.joints[j].name;
    r.channels.push_back({name + ".motor", "rad", Role::kMotorPosition, name});
    r.samples.col(static_cast<Index>(j)) = forced.motors[j].q;
    if (name == joint) r.samples.rightCols(1) = predicted->effort[j];
  }
  r.channels.push_back({"effort", "", Role::kDriveTorque, joint});
  return r;
}

/// Motor one also moves joint two, whose own motor stands.
constexpr const char* kTwoJoints = R"(
coupling = [[0, 0], [-0.5, 0]]
[robot]
name = "two"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "one"
kind = "revolute"
motor_inertia_kg_m2 = 0.05
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
[[joint]]
name = "two"
kind = "revolute"
motor_inertia_kg_m2 = 0.05
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
)";
constexpr const char* kFrictionOfJoint = R"(
  [[joint.effect]]
  id = "joint_friction"
  level_n_m = 0.4
  presliding_rad = 0.002
)";

TEST(DiagnoseRun, FeelsTheFrictionOfAnotherJointBehindItsCable) {
  const auto given = plant_of(kTwoJoints);
  const auto improved = plant_of(std::string(kTwoJoints) + kFrictionOfJoint);
  const auto r = predicted_recording(improved, "one", 0.4);
  const HeldOut free = figure(report_of(given, improved, r), "free_run_1s_rmse");
  EXPECT_EQ(free.joint, "one");
  EXPECT_LT(free.after, 0.1 * free.before);
}

TEST(DiagnoseRun, StartsWithFrictionAsFarBuiltUpAsTheMotionLeftIt) {
  const auto plant = plant_of(std::string(kSlide) + kFriction + R"(
  [[joint.effect]]
  id = "presliding"
  displacement_m = 0.02
)");
  const auto r = predicted_recording(plant, "slide", 0.05);
  EXPECT_LT(figure(report_of(plant, plant, r), "free_run_1s_rmse").after, 2e-3);
}

TEST(DiagnoseRun, RunsOnlyWhereTheDriveWasOn) {
  auto r = recording_of({}, "slide");
  const auto plant = plant_of(std::string(kSlide) + kFriction);
  const double whole = figure(report_of(plant, plant, r), "free_run_1s_rmse").after;
  r.channels.push_back({"torque_on", "1", Role::kStatus, ""});
  r.samples.conservativeResize(Eigen::NoChange, 4);
  r.samples.col(3).setOnes();
  r.samples.col(3).segment(5'000, 3'000).setZero();
  r.samples.col(2).segment(5'000, 3'000).array() += 1e3;
  EXPECT_LT(figure(report_of(plant, plant, r), "free_run_1s_rmse").after, 2.0 * whole + 1e-4);
}

TEST(DiagnoseRun, SaturatesWhereThePlantDoes) {
  Robot robot;
  robot.limit = 10.0;
  const std::string with = std::string(kSlide) + kFriction;
  const auto given = plant_of(with);
  const auto improved = plant_of(with + R"(
  [[joint.effect]]
  id = "saturation"
  limit_n = 10.0
)");
  const HeldOut free =
      figure(report_of(given, improved, recording_of(robot, "slide")), "free_run_1s_rmse");
  EXPECT_LT(free.after, 0.2 * free.before);
}

TEST(DiagnoseRun, CountsARunThatLeftForGoodAsFarOff) {
  Robot robot;
  robot.effort_sign = -1e7;
  const auto plant = plant_of(kSlide);
  const HeldOut free =
      figure(report_of(plant, plant, recording_of(robot, "slide")), "free_run_1s_rmse");
  EXPECT_TRUE(std::isfinite(free.before));
  EXPECT_GT(free.before, 100.0);
  EXPECT_LE(free.before, 1e3);
}

}  // namespace
}  // namespace ravencal::diagnose
