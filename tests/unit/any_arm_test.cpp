// SPDX-License-Identifier: Apache-2.0
//
// Trajectories of plants of any number of joints, and their simulation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "physics/predict/predict.hpp"
#include "record/load.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"
#include "unit/long_arm.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;
using record::Role;
using test::kSliding;
using test::long_arm;

fs::path temporary_file(const std::string& name) { return fs::path(testing::TempDir()) / name; }

physics::Plant plant_of(const std::string& text) {
  auto plant = physics::parse_plant(text, "long.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

std::string without(std::string text, const std::string& line) {
  const auto at = text.find(line);
  EXPECT_NE(at, std::string::npos) << line;
  return text.erase(at, text.find('\n', at) + 1 - at);
}

trajectory::Trajectory random_of(const physics::Plant& plant, double duration_s) {
  trajectory::RandomOptions options;
  options.duration_s = duration_s;
  options.limits = trajectory::limits_of(plant).value();
  return trajectory::make_random(options).value();
}

record::Recording simulated(const physics::Plant& plant, const trajectory::Trajectory& motion,
                            const std::string& name, double rate_hz = 100.0) {
  simulation::SessionOptions options;
  options.overwrite = true;
  options.rate_hz = rate_hz;
  const auto summary = simulation::record_session(plant, motion, temporary_file(name), options,
                                                  [](double) { return true; });
  EXPECT_TRUE(summary.ok()) << (summary.ok() ? "" : summary.error().message);
  return record::load_recording(temporary_file(name), {}).value();
}

class OfJoints : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Trajectories, OfJoints, testing::Values(1, 2, 3, 4, 7, 32));

TEST_P(OfJoints, StayWithinPositionsAndSpeedsAndMoveEveryJoint) {
  const physics::Plant plant = plant_of(long_arm(GetParam()));
  trajectory::ZigzagOptions zigzag;
  zigzag.limits = trajectory::limits_of(plant).value();
  zigzag.divisions = 1;
  for (const auto& made : {trajectory::make_zigzag(zigzag).value(), random_of(plant, 60.0)}) {
    ASSERT_EQ(made.joints, trajectory::joints_of(plant));
    const auto within = trajectory::check_limits(made, plant, "made");
    EXPECT_TRUE(within.ok()) << within.error().message;
    VectorXd low = made.joints_ji.front(), high = low;
    for (const VectorXd& joints : made.joints_ji) {
      low = low.cwiseMin(joints).eval();
      high = high.cwiseMax(joints).eval();
    }
    const VectorXd range = zigzag.limits.high_ji - zigzag.limits.low_ji;
    EXPECT_GT((high - low).cwiseQuotient(range).minCoeff(), 0.5) << GetParam();
  }
}

TEST_P(OfJoints, AreReadBackFromTheirFileInAnyOrderOfColumns) {
  const physics::Plant plant = plant_of(long_arm(GetParam()));
  trajectory::Trajectory written = random_of(plant, 2.0);
  const fs::path file = temporary_file("any_arm_order.csv");
  std::reverse(written.joints.begin(), written.joints.end());
  for (VectorXd& row : written.joints_ji) row = row.reverse().eval();
  ASSERT_TRUE(trajectory::write_csv(written, file).ok());
  const auto read = trajectory::read_for_plant(file, plant);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->joints, trajectory::joints_of(plant));
  EXPECT_LT((read->joints_ji[77] - written.joints_ji[77].reverse()).norm(), 1e-7);
}

TEST(AnyArm, NamesJointLineAndLimitOfAMotionThatLeavesThem) {
  const physics::Plant plant = plant_of(long_arm(7));
  const fs::path file = temporary_file("any_arm_limits.csv");
  const auto refusal = [&](Index joint, double at, double later) {
    trajectory::Trajectory motion{trajectory::joints_of(plant), {0.0, 1.0}, {}};
    VectorXd middle = VectorXd::Zero(7);
    middle[kSliding] = 0.05;
    motion.joints_ji = {middle, middle};
    motion.joints_ji[0][joint] = at;
    motion.joints_ji[1][joint] = later;
    EXPECT_TRUE(trajectory::write_csv(motion, file).ok());
    const auto read = trajectory::read_for_plant(file, plant);
    return read.ok() ? std::string() : read.error().message;
  };
  EXPECT_EQ(refusal(6, 0.0, 0.4), "");
  EXPECT_NE(refusal(kSliding, 0.05, 0.13).find(":3: joint 'j3' at 0.13 m is above 0.12 m"),
            std::string::npos);
  EXPECT_NE(refusal(0, -0.6, -0.5).find(":2: joint 'j0' at -0.6 rad is below -0.5 rad"),
            std::string::npos);
  EXPECT_NE(refusal(6, 0.0, 0.6).find(":3: joint 'j6' at 0.6 rad/s is above 0.5 rad/s"),
            std::string::npos);
}

TEST(AnyArm, RefusesTrajectoriesOfOtherJoints) {
  const fs::path file = temporary_file("any_arm_others.csv");
  const auto refusal = [&](const std::string& header) {
    std::ofstream(file) << header << "\n0,0.05,0.05\n1,0.05,0.05\n";
    const auto read = trajectory::read_for_plant(file, plant_of(long_arm(2)));
    return read.ok() ? std::string() : read.error().message;
  };
  EXPECT_EQ(refusal("t_s,j1_rad,j0_rad"), "");
  EXPECT_NE(refusal("t_s,j0_rad,j2_rad").find("no column of 'j1'"), std::string::npos);
  EXPECT_NE(refusal("t_s,j0_rad,j1_m").find("'j1' is in m and must be in rad"), std::string::npos);
  EXPECT_NE(refusal("t_s,j0_rad,j0_rad").find("'j0' stands twice"), std::string::npos);
  EXPECT_NE(refusal("t_s,j0_rad,j1").find("column 3 'j1' has no unit"), std::string::npos);
}

TEST(AnyArm, AsksForLimitsThatThePlantDoesNotState) {
  const auto limits = trajectory::limits_of(plant_of(without(long_arm(7), "  speed_m_per_s")));
  ASSERT_FALSE(limits.ok());
  EXPECT_NE(limits.error().message.find("joint 'j3' states no speed_m_per_s in [joint.limits]"),
            std::string::npos)
      << limits.error().message;
}

constexpr double kRate_hz = 1000.0;

/// The recorded motion asks for the recorded efforts, by the equations of another part of the code.
TEST(AnyArm, MovesAsItsEffortsAndItsLinksSay) {
  const physics::Plant plant = plant_of(long_arm(7));
  const auto recording = simulated(plant, random_of(plant, 20.0), "any_arm_efforts.db", kRate_hz);
  physics::ForcedMotion forced;
  forced.t_s.resize(recording.rows());
  for (Index i = 0; i < recording.rows(); ++i)
    forced.t_s[i] = 1e-9 * static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)]);
  forced.fresh.assign(static_cast<std::size_t>(recording.rows()), 0);
  forced.fresh.front() = 1;
  for (const physics::Joint& joint : plant.joints) {
    const auto of_motor = [&](Role role) {
      return VectorXd(recording.samples.col(*recording.column(role, joint.name)) / joint.reduction);
    };
    const VectorXd v = of_motor(Role::kMotorVelocity);
    VectorXd a = VectorXd::Zero(v.size());
    for (Index i = 1; i + 1 < v.size(); ++i) a[i] = 0.5 * kRate_hz * (v[i + 1] - v[i - 1]);
    forced.motors.push_back({of_motor(Role::kMotorPosition), v, a, 0.0});
  }
  const auto predicted = physics::predict(plant, forced);
  ASSERT_TRUE(predicted.ok());
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    const VectorXd effort =
        recording.samples.col(*recording.column(Role::kDriveTorque, joint.name)) *
        (joint.reduction / joint.gearbox_ratio);
    EXPECT_LT((predicted->effort[j] - effort).norm(), 0.02 * effort.norm()) << joint.name;
    const VectorXd truth = recording.samples.col(*recording.column(Role::kJointTruth, joint.name));
    EXPECT_LT((predicted->position[j] - truth).cwiseAbs().maxCoeff(), 1e-5) << joint.name;
  }
}

TEST(AnyArm, OfOneJointFollowsWithItsOwnServoOrOneOfTheSimulation) {
  const auto error_of = [](const std::string& text) {
    const physics::Plant plant = plant_of(text);
    const auto recording = simulated(plant, random_of(plant, 10.0), "any_arm_one.db");
    const VectorXd error = recording.samples.col(*recording.column(Role::kDesiredPosition, "j0")) -
                           recording.samples.col(*recording.column(Role::kJointEstimate, "j0"));
    const auto led = recording.meta.find("led_by_simulation");
    return std::pair(error.cwiseAbs().maxCoeff(),
                     led == recording.meta.end() ? std::string() : led->second);
  };
  std::string led = long_arm(1);
  for (const char* line : {"  [joint.controller]", "  kp_n_m", "  kd_n_m", "  dac_limit"})
    led = without(led, line);
  const auto [own_error, own] = error_of(long_arm(1));
  const auto [led_error, name] = error_of(led);
  EXPECT_LT(own_error, 0.06);
  EXPECT_EQ(own, "");
  EXPECT_LT(led_error, 0.01);
  EXPECT_EQ(name, "j0");
}

TEST(AnyArm, StaysWithinTheEffortThatItsDrivesHave) {
  std::string text = long_arm(2);
  text += "  [[joint.effect]]\n  id = \"saturation\"\n  limit_n_m = 0.2\n";
  const physics::Plant plant = plant_of(text);
  const auto recording = simulated(plant, random_of(plant, 5.0), "any_arm_limit.db");
  const VectorXd effort = recording.samples.col(*recording.column(Role::kDriveTorque, "j1"));
  EXPECT_NEAR(effort.cwiseAbs().maxCoeff(), 0.2, 1e-12);
  EXPECT_TRUE(recording.samples.allFinite());
}

TEST(AnyArm, RefusesWhatOnlyTheTwinHas) {
  const physics::Plant plant = plant_of(long_arm(1));
  simulation::SessionOptions options;
  options.drift = true;
  const auto summary =
      simulation::record_session(plant, random_of(plant, 2.0), temporary_file("any_arm_no.db"),
                                 options, [](double) { return true; });
  ASSERT_FALSE(summary.ok());
  EXPECT_NE(summary.error().message.find("drift"), std::string::npos);
  EXPECT_FALSE(fs::exists(temporary_file("any_arm_no.db")));
}

}  // namespace
