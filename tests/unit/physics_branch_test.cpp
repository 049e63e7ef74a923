// SPDX-License-Identifier: Apache-2.0
//
// The digital twin with the traits of the controller's published branches: gravity torque, homing,
// velocities, age of the encoder counts, and the mirrored arm.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "physics/arm_dynamics.hpp"
#include "physics/controller_branch.hpp"
#include "physics/raven_arms.hpp"
#include "physics/raven_twin.hpp"
#include "unit/twin_rig.hpp"

namespace ravencal::physics {
namespace {

using core::catalogue_index;
using core::RavenField;
using Eigen::Vector3d;

Plant plant_with(std::string_view branch) {
  Plant plant = shipped_plant();
  const ControllerBranch* found = find_controller_branch(branch);
  plant.robot.controller = found == nullptr ? ControllerBranch{} : *found;
  return plant;
}

RavenTwin twin_of(const Plant& plant) {
  auto twin = RavenTwin::create(plant, 1);
  EXPECT_TRUE(twin.ok()) << twin.error().message;
  return std::move(twin).value();
}

Vector3d first_three(const RavenMessage& message, RavenField field, double factor = 1.0) {
  return factor * Vector3d(at(message, field, 0), at(message, field, 1), at(message, field, 2));
}

void follow_wave(RavenTwin& twin, int cycles) {
  for (int i = 0; i < cycles; ++i) {
    twin.begin_cycle();
    twin.end_cycle(wave(i));
  }
}

/// Torque at the gearbox outputs that carries the links at `joints_ji`, by the plant's masses.
Vector3d weight_torque(const Plant& plant, const Vector3d& joints_ji) {
  ArmDynamics dynamics(plant, plant.robot.arm == "gold" ? Arm::kGold : Arm::kGreen, false);
  const Vector3d weight = dynamics.gravity(joints_ji);
  Vector3d torque;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Joint& joint = plant.joints[static_cast<std::size_t>(i)];
    torque[i] = weight[i] / joint.reduction * joint.gearbox_ratio;
  }
  return torque;
}

TEST(ControllerBranch, IsReadFromThePlantAndRefusedIfUnknown) {
  const std::string text = R"([robot]
name = "two"
controller = "NAME"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "a"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1
reduction = 1
joint_encoder_resolution_rad = 1e-5
)";
  const auto read = [&](const std::string& name) {
    std::string with_name = text;
    with_name.replace(with_name.find("NAME"), 4, name);
    return parse_plant(with_name, "two.toml");
  };
  for (const std::string name : {"main", "crtk"}) {
    const auto plant = read(name);
    ASSERT_TRUE(plant.ok()) << plant.error().message;
    EXPECT_EQ(plant->robot.controller.name, name);
  }
  const auto unknown = read("devel");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("two.toml:3"), std::string::npos)
      << unknown.error().message;
  EXPECT_NE(unknown.error().message.find("main, crtk"), std::string::npos);
}

class BranchTwin : public testing::TestWithParam<std::string> {
 protected:
  Plant plant_ = plant_with(GetParam());
};
INSTANTIATE_TEST_SUITE_P(All, BranchTwin, testing::Values("main", "crtk"),
                         [](const auto& instance) { return instance.param; });

TEST_P(BranchTwin, AddsTheLinksWeightToTheServosTorqueInJointControl) {
  RavenTwin twin = homed_twin(plant_);
  follow_wave(twin, 500);
  twin.begin_cycle();
  const RavenMessage& message = twin.end_cycle(wave(500));
  const Vector3d joints = first_three(message, RavenField::kJpos, kDeg);
  const Vector3d weight = weight_torque(plant_, joints);
  ASSERT_GT(weight.cwiseAbs().minCoeff(), 0.005) << "each joint carries something there";
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const Controller& pd = *plant_.joints[joint].controller;
    const double servo =
        pd.kp_n_m_per_rad * kDeg *
            (at(message, RavenField::kMposD, joint) - at(message, RavenField::kMpos, joint)) -
        pd.kd_n_m_s_per_rad * kDeg * at(message, RavenField::kMvel, joint);
    EXPECT_NEAR(at(message, RavenField::kTau, joint) - servo, weight[i], 1e-4) << "joint " << i;
  }
}

TEST_P(BranchTwin, FeedsTheWeightWithThePedalUpButNotAtTheEmergencyStop) {
  RavenTwin twin = homed_twin(plant_);
  twin.begin_cycle();
  const RavenMessage pedal_up = twin.end_braked_cycle(true);
  const Vector3d weight = weight_torque(plant_, first_three(pedal_up, RavenField::kJpos, kDeg));
  EXPECT_TRUE(first_three(pedal_up, RavenField::kTau).isApprox(weight, 1e-4))
      << first_three(pedal_up, RavenField::kTau).transpose() << " for " << weight.transpose();
  EXPECT_NE(at(pedal_up, RavenField::kDac, 1), 0.0);
  twin.begin_cycle();
  const RavenMessage& stopped = twin.end_braked_cycle(false);
  EXPECT_EQ(first_three(stopped, RavenField::kTau), Vector3d::Zero());
  EXPECT_EQ(first_three(stopped, RavenField::kDac), Vector3d::Zero());
}

/// What homing shows: the last message before the zeros are set, and the cycles from then on until
/// the arm is at home.
struct Homing {
  RavenMessage at_stops{};
  int cycles_to_home = 0;
};

Homing watch_homing(const Plant& plant) {
  RavenTwin twin = twin_of(plant);
  Homing seen;
  twin.start_homing();
  twin.begin_cycle();
  RavenMessage last = twin.end_homing_cycle();
  for (int i = 0; i < 60'000 && !twin.homed(); ++i) {
    twin.begin_cycle();
    const RavenMessage& message = twin.end_homing_cycle();
    const bool zeros_set =
        at(message, RavenField::kEncOffsets, 0) != at(last, RavenField::kEncOffsets, 0);
    if (zeros_set) seen.at_stops = last;
    if (zeros_set || seen.cycles_to_home > 0) ++seen.cycles_to_home;
    last = message;
  }
  EXPECT_TRUE(twin.homed());
  return seen;
}

TEST_P(BranchTwin, HoldsJointsAtTheirStopsByPdWhileOthersSeekTheirs) {
  const Homing seen = watch_homing(plant_);
  double largest = 0.0;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    const double apart = kDeg * (at(seen.at_stops, RavenField::kMposD, joint) -
                                 at(seen.at_stops, RavenField::kMpos, joint));
    const Controller& pd = *plant_.joints[joint].controller;
    const double damping = pd.kd_n_m_s_per_rad * kDeg * at(seen.at_stops, RavenField::kMvel, joint);
    const double torque = at(seen.at_stops, RavenField::kTau, joint);
    EXPECT_NEAR(torque, pd.kp_n_m_per_rad * apart - damping, 1e-4) << "joint " << joint;
    EXPECT_LT(std::abs(at(seen.at_stops, RavenField::kDac, joint)), 1500.0);
    largest = std::max(largest, std::abs(torque));
  }
  EXPECT_GT(largest, 0.01) << "cables that were stretched pull back";
}

TEST(ControllerBranch, TakesThreeSecondsFromTheStopsToHomeOnTheCrtkBranch) {
  EXPECT_NEAR(watch_homing(plant_with("crtk")).cycles_to_home, 3000, 2);
  EXPECT_NEAR(watch_homing(plant_with("main")).cycles_to_home, 2500, 2);
}

/// Largest difference between jvel and what jpos moved by since the cycle before, joints 1 to 3 and
/// roll, in rad/s and m/s.
std::array<double, 4> velocity_error(const Plant& plant) {
  RavenTwin twin = homed_twin(plant);
  follow_wave(twin, 1000);
  RavenMessage last{};
  std::array<double, 4> largest{};
  constexpr std::array<std::size_t, 4> kSlots = {0, 1, 2, 4};
  for (int i = 1000; i < 1500; ++i) {
    twin.begin_cycle();
    const RavenMessage& message = twin.end_cycle(wave(i));
    for (std::size_t n = 0; n < kSlots.size() && i > 1000; ++n) {
      const double moved =
          (at(message, RavenField::kJpos, kSlots[n]) - at(last, RavenField::kJpos, kSlots[n])) *
          kDeg * 1e3;
      largest[n] =
          std::max(largest[n], std::abs(moved - kDeg * at(message, RavenField::kJvel, kSlots[n])));
    }
    last = message;
  }
  return largest;
}

TEST(ControllerBranch, CouplesJointVelocitiesOnTheCrtkBranchOnly) {
  const std::array<double, 4> coupled = velocity_error(plant_with("crtk"));
  const std::array<double, 4> uncoupled = velocity_error(plant_with("main"));
  // float32 degrees of 90 differ by 8e-6: 1.3e-4 rad/s; one count is 2 pi / 4000 / reduction.
  EXPECT_LT(coupled[1], 3e-4);
  EXPECT_LT(coupled[2], 3e-4);
  EXPECT_LT(coupled[3], 1e-3);
  EXPECT_LT(uncoupled[0], 3e-4) << "nothing couples to the shoulder";
  EXPECT_GT(uncoupled[1], 1e-3);
}

TEST_P(BranchTwin, ReadsEncodersThatAreOneCycleOld) {
  const auto counts_moved_while_braked = [](const Plant& plant) {
    RavenTwin twin = homed_twin(plant);
    int moved = 0;
    for (int i = 0; i < 1000; ++i) {
      const double before = at(twin.begin_cycle(), RavenField::kEncVals, 1);
      twin.end_braked_cycle(true);
      moved += at(twin.begin_cycle(), RavenField::kEncVals, 1) != before ? 1 : 0;
      twin.end_cycle(wave(i));
    }
    return moved;
  };
  EXPECT_GT(counts_moved_while_braked(plant_), 50) << "what the cycle before had moved";
  EXPECT_EQ(counts_moved_while_braked(plant_with("")), 0);
}

TEST(ControllerBranch, APlantWithoutOneKeepsTheIdealisedController) {
  const Homing seen = watch_homing(plant_with(""));
  EXPECT_EQ(first_three(seen.at_stops, RavenField::kTau), Vector3d::Zero());
  EXPECT_NEAR(seen.cycles_to_home, 2500, 2);
}

TEST(MirroredArm, CarriesTheSameWeightInEveryPose) {
  Plant gold = plant_with("");
  gold.joints[2].link.com_m = {0.01, 0.02, 0.03};
  gold.payload = {0.5, {0.02, -0.01, 0.03}};
  const Plant green = plant_of_arm(gold, "green");
  ArmDynamics gold_dynamics(gold, Arm::kGold, true);
  ArmDynamics green_dynamics(green, Arm::kGreen, true);
  for (const double shoulder : {0.3, 0.8, 1.2}) {
    for (const double elbow : {0.9, 1.5, 2.0}) {
      for (const double insertion : {0.32, 0.40, 0.43}) {
        const Vector3d joints(shoulder, elbow, insertion);
        EXPECT_TRUE(gold_dynamics.gravity(joints).isApprox(green_dynamics.gravity(joints), 1e-9))
            << joints.transpose();
        EXPECT_TRUE(
            gold_dynamics.mass_matrix(joints).isApprox(green_dynamics.mass_matrix(joints), 1e-9));
      }
    }
  }
  // grav_comp.cpp, COM1_1_GR and COM2_2_GR.
  EXPECT_EQ(green.joints[0].link.com_m, (std::array<double, 3>{-0.0065, -0.09775, 0.13771}));
  EXPECT_EQ(green.joints[1].link.com_m, (std::array<double, 3>{-0.002, -0.18274, 0.23053}));
}

TEST_P(BranchTwin, TheGreenArmErrsNoMoreThanTheGoldOne) {
  const auto rms_shoulder_deg = [](const Plant& plant) {
    RavenTwin twin = homed_twin(plant);
    double sum = 0.0;
    for (int i = 0; i < 20'000; ++i) {
      twin.begin_cycle();
      twin.end_cycle(wave(i));
      const double error = (twin.truth().joints_ji - twin.estimate_ji())[0] / kDeg;
      sum += error * error / 20'000;
    }
    return std::sqrt(sum);
  };
  const double gold = rms_shoulder_deg(plant_);
  const double green = rms_shoulder_deg(plant_of_arm(plant_, "green"));
  RecordProperty("gold_deg", std::to_string(gold));
  RecordProperty("green_deg", std::to_string(green));
  EXPECT_LT(green, 3.0);
  EXPECT_NEAR(green, gold, 0.5);
}

}  // namespace
}  // namespace ravencal::physics
