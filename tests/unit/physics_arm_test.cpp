// SPDX-License-Identifier: Apache-2.0
//
// Kinematics against published vectors; dynamics against conservation.
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <string>

#include "physics/arm_dynamics.hpp"
#include "physics/arm_physics.hpp"
#include "physics/raven_kinematics.hpp"
#include "unit/twin_rig.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Vector3d;

void remove_effect(Plant& plant, std::string_view id) {
  for (Joint& joint : plant.joints) {
    std::erase_if(joint.effects, [&](const Effect& effect) { return effect.id == id; });
  }
}

TEST(ForwardKinematics, ReproducesTheControllersTestVectors) {
  const SlotVector joints = {30.0 * kDeg, 90.0 * kDeg, 0.40, 0, 0, 0, 0, 0};
  const ToolPose gold = forward_kinematics(Arm::kGold, joints);
  EXPECT_NEAR(gold.position_um[0], -77947.0, 1.0);
  EXPECT_NEAR(gold.position_um[1], -25265.6, 1.0);
  EXPECT_NEAR(gold.position_um[2], 13225.6, 1.0);
  const ToolPose green = forward_kinematics(Arm::kGreen, joints);
  EXPECT_NEAR(green.position_um[0], -77947.0, 1.0);
  EXPECT_NEAR(green.position_um[1], 25265.6, 1.0);
  EXPECT_NEAR(green.position_um[2], 13225.6, 1.0);
}

TEST(PlaceholderJacobian, IsAFixedLinearFunctionOfTheVelocities) {
  const SlotVector joints = {0.5, 1.5, 0.4, 0, 0.1, 0.2, 0.7, 0.8};
  SlotVector velocities = {0.01, 0.02, 0.003, 0, 0.1, 0.2, 0, 0};
  const auto once = placeholder_jacobian_velocity(joints, velocities);
  for (double& velocity : velocities) velocity *= 2.0;
  const auto twice = placeholder_jacobian_velocity(joints, velocities);
  double size = 0.0;
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_NEAR(twice[i], 2.0 * once[i], 1e-12);
    size += std::abs(once[i]);
  }
  EXPECT_GT(size, 0.0);
}

TEST(ArmDynamics, GravityIsTheGradientOfThePotentialEnergy) {
  // Independent of KDL: gravity from the height of the centres of mass by finite differences.
  const Plant plant = shipped_plant();
  ArmDynamics dynamics(plant, Arm::kGold, true);
  const DhTable& dh = dh_table(Arm::kGold);
  const auto potential = [&](const Vector3d& q) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    double energy = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      pose.rotate(Eigen::AngleAxisd(dh.alpha_rad[i], Vector3d::UnitX()));
      const double theta = dh.theta_offset_rad[i] + (i < 2 ? q[static_cast<Eigen::Index>(i)] : 0.0);
      pose.rotate(Eigen::AngleAxisd(theta, Vector3d::UnitZ()));
      if (i == 2) pose.translate(Vector3d(0, 0, q[2]));
      const Link& link = plant.joints[i].link;
      energy +=
          link.mass_kg * 9.8 * (pose * Vector3d(link.com_m[0], link.com_m[1], link.com_m[2])).x();
    }
    return energy;
  };
  const Vector3d q(40 * kDeg, 80 * kDeg, 0.38);
  const Vector3d gravity = dynamics.gravity(q);
  for (Eigen::Index i = 0; i < 3; ++i) {
    Vector3d step = Vector3d::Zero();
    step[i] = 1e-6;
    EXPECT_NEAR(gravity[i], (potential(q + step) - potential(q - step)) / 2e-6, 1e-6) << i;
  }
}

TEST(ArmDynamics, MassMatrixIsSymmetricAndPositive) {
  const Plant plant = shipped_plant();
  ArmDynamics dynamics(plant, Arm::kGold, true);
  const Eigen::Matrix3d mass = dynamics.mass_matrix({0.6, 1.4, 0.38});
  EXPECT_LT((mass - mass.transpose()).norm(), 1e-12);
  EXPECT_GT(mass.eigenvalues().real().minCoeff(), 0.0);
  EXPECT_NEAR(mass(2, 2), 0.231, 1e-9);
}

TEST(ArmPhysics, AStillArmWithoutWeightStaysStill) {
  Plant plant = shipped_plant();
  plant.robot.gravity_m_per_s2 = {};
  remove_effect(plant, "thermal_drift");
  remove_effect(plant, "eccentricity");
  auto arm = ArmPhysics::create(plant, false);
  ASSERT_TRUE(arm.ok()) << arm.error().message;
  core::Random random(1);
  const Vector3d start(0.7, 1.4, 0.38);
  arm->place(start);
  for (int i = 0; i < 5000; ++i) arm->advance(Vector3d::Zero(), random);
  EXPECT_LT((arm->joints_ji() - start).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(arm->kinetic_energy_j(), 0.0);
}

TEST(ArmPhysics, AFreeOscillationDies) {
  Plant plant = shipped_plant();
  plant.robot.gravity_m_per_s2 = {};
  remove_effect(plant, "thermal_drift");
  auto arm = ArmPhysics::create(plant, false);
  ASSERT_TRUE(arm.ok());
  core::Random random(1);
  arm->place({0.7, 1.4, 0.38});
  for (int i = 0; i < 50; ++i) arm->advance({1.5, 1.5, 1.0}, random);  // a blow
  const double after_blow = arm->kinetic_energy_j();
  EXPECT_GT(after_blow, 1e-3);
  double largest_late = 0.0;
  for (int i = 0; i < 3000; ++i) {
    arm->advance(Vector3d::Zero(), random);
    if (i > 2000) largest_late = std::max(largest_late, arm->kinetic_energy_j());
  }
  EXPECT_LT(largest_late, 1e-9 * after_blow);
}

TEST(ArmPhysics, WithoutFrictionAndDampingTheEnergyIsKept) {
  Plant plant = shipped_plant();
  for (const char* id :
       {"thermal_drift", "joint_friction", "hysteresis", "creep", "backlash", "coulomb_friction",
        "viscous_friction", "stribeck_friction", "presliding"}) {
    remove_effect(plant, id);
  }
  for (Joint& joint : plant.joints) {
    for (Effect& effect : joint.effects) {
      if (effect.id == "compliance") effect.parameters["damping"] = 0.0;
    }
    joint.homing.reset();
  }
  plant.robot.gravity_m_per_s2 = {};
  auto arm = ArmPhysics::create(plant, false);
  ASSERT_TRUE(arm.ok());
  core::Random random(1);
  arm->place({0.7, 1.4, 0.38});
  for (int i = 0; i < 5; ++i) arm->advance({0.5, -0.5, 0.3}, random);
  // Energy moves between links and springs; over whole seconds its kinetic peak must not change.
  const auto peak = [&] {
    double largest = 0.0;
    for (int i = 0; i < 1000; ++i) {
      arm->advance(Vector3d::Zero(), random);
      largest = std::max(largest, arm->kinetic_energy_j());
    }
    return largest;
  };
  const double early = peak();
  double late = 0.0;
  for (int i = 0; i < 5; ++i) late = peak();
  EXPECT_NEAR(late / early, 1.0, 0.05);
}

TEST(ArmPhysics, AnOffsetOfTheEffortIsAskedOnTopOfWhatTheMotionNeeds) {
  Plant plant = shipped_plant();
  remove_effect(plant, "torque_constant");
  for (Joint& joint : plant.joints)
    joint.effects.push_back({"torque_constant", {}, {{"ratio", 0.1}}});
  Plant biased = plant;
  Vector3d offset_n_m;  // at the gearbox output, where torque is asked
  for (Eigen::Index i = 0; i < 3; ++i) {
    Joint& joint = biased.joints[static_cast<std::size_t>(i)];
    const double offset = 0.5 + 0.2 * static_cast<double>(i);
    joint.effects.push_back({"effort_offset", {}, {{"offset", offset}}});
    offset_n_m[i] = offset * joint.gearbox_ratio / joint.reduction;
  }
  auto needed = ArmPhysics::create(plant, false);
  auto asked = ArmPhysics::create(biased, false);
  ASSERT_TRUE(needed.ok() && asked.ok());
  core::Random one(1), other(1);
  const Vector3d start(0.7, 1.4, 0.38);
  needed->place(start);
  asked->place(start);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d torque_n_m = std::sin(0.01 * i) * Vector3d(0.6, 0.6, 0.4);
    needed->advance(torque_n_m, one);
    asked->advance(torque_n_m + offset_n_m, other);
  }
  EXPECT_GT((needed->joints_ji() - start).cwiseAbs().minCoeff(), 1e-4) << "all of them moved";
  EXPECT_LT((asked->joints_ji() - needed->joints_ji()).cwiseAbs().maxCoeff(), 1e-6);
}

/// Motors that do not move, and an arm that hangs in its cables: stretch is load over stiffness.
TEST(ArmPhysics, ACableOverALinkLoadsThatLinksCable) {
  for (const bool link : {true, false}) {
    Plant plant = shipped_plant();
    for (Joint& joint : plant.joints) {
      std::erase_if(joint.effects, [](const Effect& effect) { return effect.id != "compliance"; });
      joint.homing.reset();
      joint.motor_inertia_kg_m2 = 1e6;
      for (Effect& effect : joint.effects)
        effect.parameters["damping"] = 0.05 * effect.parameters["stiffness"];
    }
    if (link) plant.joints[1].coupling_through = plant.joints[2].coupling_through = Through::kLink;
    auto arm = ArmPhysics::create(plant, false);
    ASSERT_TRUE(arm.ok());
    core::Random random(1);
    const Vector3d start(0.7, 1.4, 0.38);
    arm->place(start);
    for (int i = 0; i < 5000; ++i) arm->advance(Vector3d::Zero(), random);
    const Vector3d q = arm->joints_ji();
    Vector3d load = ArmDynamics(plant, Arm::kGold, true).gravity(q);
    // The end of each cable at its motor's side, and what cables behind it pull at this one's link.
    Vector3d end = start;
    if (link) {
      end[1] += plant.coupling[1][0] * (q[0] - start[0]);
      end[2] += plant.coupling[2][0] * (q[0] - start[0]) + plant.coupling[2][1] * (q[1] - start[1]);
      load[1] += plant.coupling[2][1] * load[2];
      load[0] += plant.coupling[2][0] * load[2] + plant.coupling[1][0] * load[1];
    }
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double stiffness =
          plant.joints[static_cast<std::size_t>(i)].parameter("compliance", "stiffness");
      EXPECT_NEAR(stiffness * (end[i] - q[i]), load[i], 1e-3 * std::abs(load[i])) << link << i;
    }
  }
}

TEST(ArmPhysics, RefusesAPlantWithoutCables) {
  Plant plant = shipped_plant();
  remove_effect(plant, "compliance");
  const auto arm = ArmPhysics::create(plant, false);
  ASSERT_FALSE(arm.ok());
  EXPECT_NE(arm.error().message.find("compliance"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::physics
