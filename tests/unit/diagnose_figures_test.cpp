// SPDX-License-Identifier: Apache-2.0
//
// Figures of a view: errors before and after, what the recordings show, and what is left above what
// they repeat.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/explain/parts.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/track/filter.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Role;

constexpr double kPeriodS = 0.02;
constexpr double kReduction = 50.0;
constexpr double kToJoint = 5.0;

/// Two level joints behind stiff cables.
physics::Plant two_joints() {
  std::string text = R"(
[robot]
name = "two"
gravity_m_per_s2 = [0.0, -9.8, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
)";
  for (const char* name : {"one", "two"})
    text += std::string("[[joint]]\nname = \"") + name + R"("
kind = "revolute"
motor_inertia_kg_m2 = 1e-4
gearbox_ratio = 10.0
reduction = 50.0
joint_encoder_resolution_rad = 1e-4
  [joint.link]
  mass_kg = 1.0
  com_m = [0.2, 0.0, 0.0]
  inertia_kg_m2 = [0.0, 0.0, 0.01]
  [[joint.effect]]
  id = "coulomb_friction"
  level_n_m = 0.5
)";
  auto plant = physics::parse_plant(text, "test.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

struct Scene {
  Index rows = 12000;
  bool effort = true, truth = true;  ///< recorded of joint one; of joint two only the motor is
  double effort_noise_n_m = 0.02, effort_offset_n_m = 0.0;
  double encoder_constant_rad = 0.0;
  std::function<double(double q_rad)> unsaid{};  ///< effort that the plant lacks
  double rest_s = 0.0;                           ///< joint one stands from the start
};

record::Recording recording_of(const physics::Plant& plant, const Scene& scene, unsigned seed) {
  physics::ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(scene.rows, 0.0, kPeriodS * static_cast<double>(scene.rows - 1));
  forced.fresh.assign(static_cast<std::size_t>(scene.rows), 0);
  forced.fresh.front() = 1;
  const Eigen::ArrayXd moving_s = (forced.t_s.array() - scene.rest_s).max(0.0);
  for (const double rate : {1.1, 0.4}) {
    const VectorXd q = 0.4 * (rate * moving_s).sin() + 0.1 * (2.7 * rate * moving_s).sin();
    forced.motors.push_back(
        {q, first_difference(q, kPeriodS), second_difference(q, kPeriodS), 0.0});
  }
  const auto predicted = physics::predict(plant, forced);
  EXPECT_TRUE(predicted.ok());
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  record::Recording r;
  r.source = "test";
  r.channels = {{"one.motor", "rad", Role::kMotorPosition, "one"},
                {"two.motor", "rad", Role::kMotorPosition, "two"}};
  if (scene.effort) r.channels.push_back({"one.torque", "N_m", Role::kDriveTorque, "one"});
  if (scene.truth) r.channels.push_back({"one.truth", "rad", Role::kJointTruth, "one"});
  r.samples.resize(scene.rows, static_cast<Index>(r.channels.size()));
  for (Index i = 0; i < scene.rows; ++i) {
    r.t_ns.push_back(std::llround(1e9 * forced.t_s[i]));
    const double q = forced.motors[0].q[i];
    Index column = 0;
    r.samples(i, column++) = kReduction * q;
    r.samples(i, column++) = kReduction * forced.motors[1].q[i];
    const double effort = predicted->effort[0][i] + scene.effort_offset_n_m +
                          (scene.unsaid ? scene.unsaid(q) : 0.0) +
                          scene.effort_noise_n_m * noise(random);
    if (scene.effort) r.samples(i, column++) = effort / kToJoint;
    if (scene.truth)
      r.samples(i, column) =
          predicted->position[0][i] + scene.encoder_constant_rad + 1e-4 * noise(random);
  }
  return r;
}

/// `given`: the plant that is compared with recordings of `robot`.
Likelihood likelihood_of(const physics::Plant& robot, const std::vector<Scene>& scenes,
                         const physics::Plant& given) {
  std::vector<Track> tracks;
  unsigned seed = 1;
  for (const Scene& scene : scenes)
    tracks.push_back(*make_track(recording_of(robot, scene, seed++), given, 0.0, 1e9));
  Likelihood likelihood(given, std::move(tracks));
  likelihood.estimate_noise(likelihood.base());
  return likelihood;
}

Likelihood likelihood_of(const physics::Plant& robot, const std::vector<Scene>& scenes) {
  return likelihood_of(robot, scenes, robot);
}

const HeldOut* figure(const Report& report, const std::string& metric) {
  const auto it = std::find_if(report.held_out.begin(), report.held_out.end(),
                               [&](const HeldOut& h) { return h.metric == metric; });
  return it == report.held_out.end() ? nullptr : &*it;
}

TEST(DiagnoseFigures, ArePlantsErrorsWithTheirInterval) {
  const physics::Plant robot = two_joints();
  physics::Plant given = robot;
  set_plant_number(given, 0, "coulomb_friction", "level", 0.1);
  const Likelihood rows = likelihood_of(robot, {{}, {.rows = 6000}}, given);
  Report report;
  add_held_out(view_of(given, robot, rows, true), 3, report);
  const HeldOut* effort = figure(report, "effort_rmse");
  ASSERT_NE(effort, nullptr);
  EXPECT_EQ(effort->joint, "one");
  EXPECT_EQ(effort->unit, "N_m");
  // The friction that it lacks, and what the filter leaves of the noise.
  EXPECT_NEAR(effort->before, 0.4, 0.04);
  EXPECT_NEAR(effort->after, 0.02 * std::sqrt(51.0 / 375.0), 0.002);
  ASSERT_TRUE(effort->change_ci95.has_value());
  EXPECT_LT(effort->change_ci95->first, effort->change());
  EXPECT_GT(effort->change_ci95->second, effort->change());
  EXPECT_LT(effort->change_ci95->second, -0.97);
  ASSERT_EQ(effort->by_recording.size(), 2U);
  EXPECT_EQ(effort->by_recording[1].recording, 4U);
  const HeldOut* position = figure(report, "position_rmse");
  ASSERT_NE(position, nullptr);
  EXPECT_DOUBLE_EQ(position->before, position->after);
  const HeldOut* relative = figure(report, "effort_relative_error");
  const HeldOut* unfiltered = figure(report, "effort_relative_error_unfiltered");
  ASSERT_NE(relative, nullptr);
  ASSERT_NE(unfiltered, nullptr);
  EXPECT_NEAR(relative->after / relative->before, effort->after / effort->before, 1e-9);
  EXPECT_GT(unfiltered->after, 2.0 * relative->after);
}

TEST(DiagnoseFigures, HaveNoIntervalOfAFewStretchesAndNoUnfilteredOneOfFittedRows) {
  const physics::Plant robot = two_joints();
  const Likelihood rows = likelihood_of(robot, {{.rows = 64}});
  Report report;
  add_held_out(view_of(robot, robot, rows, false), 0, report);
  const HeldOut* position = figure(report, "position_rmse");
  ASSERT_NE(position, nullptr);
  EXPECT_FALSE(position->change_ci95.has_value());
  EXPECT_EQ(figure(report, "effort_relative_error_unfiltered"), nullptr);
}

TEST(DiagnoseFigures, CallAPositionBesideItsCommandAlone) {
  const physics::Plant robot = two_joints();
  record::Recording recording = recording_of(robot, {.effort = false, .truth = false}, 1);
  recording.channels[1] = {"one.desired", "rad", Role::kDesiredPosition, "one"};
  recording.samples.col(1) = recording.samples.col(0) / kReduction;
  std::vector<Track> tracks;
  tracks.push_back(*make_track(recording, robot, 0.0, 1e9));
  EXPECT_TRUE(tracks[0].joints[0].tracking);
  const Likelihood rows(robot, std::move(tracks));
  Report report;
  add_held_out(view_of(robot, robot, rows, false), 0, report);
  EXPECT_NE(figure(report, "tracking_rmse"), nullptr);
  EXPECT_EQ(figure(report, "position_rmse"), nullptr);
}

std::string because(const Report& report, const std::string& joint, const std::string& stage) {
  for (const NotLookedAt& n : report.not_looked_at)
    if (n.joint == joint && n.stage == stage) return n.because;
  return "";
}

TEST(DiagnoseLookedAt, SaysWhatTheRowsCover) {
  const physics::Plant robot = two_joints();
  const Likelihood fitted = likelihood_of(robot, {{.rest_s = 60.0}});
  const Likelihood unseen = likelihood_of(robot, {{.rows = 2000}});
  Report report;
  add_looked_at(fitted, &unseen, robot, report);
  ASSERT_EQ(report.looked_at.size(), 2U);
  const LookedAt& drive = report.looked_at[0];
  EXPECT_EQ(drive.stage, "drive");
  EXPECT_EQ(drive.position_unit, "rad");
  EXPECT_EQ(drive.effort_unit, "N_m");
  EXPECT_GT(drive.held_out_rows, 100U);
  EXPECT_GT(drive.rows, drive.held_out_rows + 1000U);
  EXPECT_NEAR(drive.band_hz.first, 1.0 / 240.0, 1e-4);
  EXPECT_NEAR(drive.band_hz.second, 3.2, 0.1);
  EXPECT_NEAR(drive.position.second, 0.5, 0.03);
  EXPECT_NEAR(drive.fastest, 0.74, 0.03);
  // 60 s of 240, and the reversals.
  EXPECT_NEAR(drive.rest_share, 0.26, 0.015);
  ASSERT_TRUE(drive.load.has_value());
  EXPECT_GT(drive.load->second, 0.1);
  const std::vector<std::string> compared = {"position", "velocity",        "acceleration",
                                             "load",     "position of two", "velocity of two"};
  EXPECT_EQ(drive.circumstances, compared);
  EXPECT_NE(because(report, "one", "command").find("control law"), std::string::npos);
  EXPECT_NE(because(report, "two", "drive").find("too few of this joint's positions"),
            std::string::npos);
}

TEST(DiagnoseLookedAt, SaysWhichSignalIsMissing) {
  const physics::Plant robot = two_joints();
  Report without_truth, without_effort;
  add_looked_at(likelihood_of(robot, {{.truth = false}}), nullptr, robot, without_truth);
  add_looked_at(likelihood_of(robot, {{.effort = false}}), nullptr, robot, without_effort);
  EXPECT_NE(because(without_truth, "one", "transmission").find("no joint_truth was recorded"),
            std::string::npos);
  EXPECT_NE(because(without_effort, "one", "drive").find("no drive effort was recorded"),
            std::string::npos);
  EXPECT_EQ(because(without_effort, "one", "transmission"), "");
}

/// The drive's.
ErrorLeft left_of(const Scene& scene) {
  const physics::Plant plant = two_joints();
  const Likelihood rows = likelihood_of(plant, {scene});
  Report report;
  add_error_left(view_of(plant, plant, rows, false), report);
  EXPECT_EQ(report.left.size(), 2U);
  EXPECT_TRUE(report.left.back().reached);
  EXPECT_EQ(report.left.front().stage, "drive");
  return report.left.front();
}

TEST(DiagnoseErrorLeft, RingsOnWhatRepeatsAndNotOnNoise) {
  const ErrorLeft said = left_of({});
  EXPECT_EQ(said.measured_by, "repetition");
  EXPECT_TRUE(said.reached);
  EXPECT_NEAR(said.floor, said.left, 0.15 * said.left);
  const auto waves = [](double q_rad) { return 0.3 * std::sin(15.0 * q_rad); };
  const ErrorLeft unsaid = left_of({.unsaid = waves});
  EXPECT_EQ(unsaid.measured_by, "repetition");
  EXPECT_FALSE(unsaid.reached);
  EXPECT_GT(unsaid.share(), 0.8);
  EXPECT_GT(unsaid.agreement, 0.9);
  const ErrorLeft noisy = left_of({.effort_noise_n_m = 0.6});
  EXPECT_TRUE(noisy.reached);
  EXPECT_GT(noisy.left, unsaid.left);
}

TEST(DiagnoseErrorLeft, LeavesTheEncodersConstantToTheHomingOffset) {
  // left_of() expects the position's floor to be reached.
  left_of({.encoder_constant_rad = 0.02});
}

TEST(DiagnoseErrorLeft, KnowsWhatTheSensorResolvesWhereNothingRepeats) {
  // Less than one turn of the motion.
  const ErrorLeft once = left_of({.rows = 150, .effort_offset_n_m = 0.1});
  EXPECT_EQ(once.measured_by, "resolution");
  EXPECT_NEAR(once.floor, 0.02 * std::sqrt(51.0 / 375.0), 0.003);
  EXPECT_TRUE(once.reached);
  EXPECT_FALSE(left_of({.rows = 150, .effort_offset_n_m = 3.0}).reached);
}

}  // namespace
}  // namespace ravencal::diagnose
