// SPDX-License-Identifier: Apache-2.0
//
// The sealed generator's mechanics against closed forms, and its nominal robot against the
// simulation that reads the same plant.toml: where nothing is left out, the two must agree.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "physics/arm_dynamics.hpp"
#include "physics/arm_physics.hpp"
#include "physics/plant.hpp"
#include "prove/generator/nominal.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::prove;

constexpr double kMs = 1e-3;

/// One revolute axis without weight: motor 0.4 kg m^2, link 0.05 kg m^2, cable 300 N m/rad.
RobotPhysics bare_axis() {
  RobotPhysics robot;
  JointPhysics joint;
  joint.motor_inertia = 0.4;
  joint.cable.stiffness = 300.0;
  robot.joints = {joint};
  ChainLink link;
  link.inertia_kg_m2 = {0.05, 0.05, 0.05};
  robot.chain = Chain({link}, Vector3d::Zero());
  return robot;
}

Mechanics started(const RobotPhysics& robot, const Vector3d& at = Vector3d::Zero()) {
  auto mechanics = Mechanics::create(robot);
  EXPECT_TRUE(mechanics.ok());
  mechanics.value().place(at);
  return std::move(mechanics).value();
}

void run(Mechanics& mechanics, CycleInputs inputs, double seconds) {
  for (int i = 0; i < static_cast<int>(seconds / kMs); ++i)
    ASSERT_TRUE(mechanics.advance(inputs, kMs).ok());
}

TEST(ProveMechanics, KeepsTheEnergyOfACableThatDoesNotLose) {
  RobotPhysics robot = bare_axis();
  robot.joints[0].flexible_inertia = 0.01;
  robot.joints[0].flexible_stiffness = 50.0;
  robot.joints[0].cable.eccentricity = {0.01, 20.0, 0.3};
  Mechanics mechanics = started(robot);
  CycleInputs push;
  push.effort[0] = 4.0;
  run(mechanics, push, 0.1);
  const double before = mechanics.energy();
  ASSERT_GT(before, 0.1);
  run(mechanics, {}, 5.0);
  EXPECT_NEAR(mechanics.energy(), before, 2e-3 * before);
}

/// Two such axes about one line; the second one's cable goes over the first one's link or drive.
RobotPhysics coupled_axes(bool over_links, const Vector3d& gravity) {
  RobotPhysics robot = bare_axis();
  robot.joints.push_back(robot.joints[0]);
  robot.joints[1].follows_links = over_links;
  robot.coupling(1, 0) = -0.4;
  ChainLink link;
  link.mass_kg = 0.5;
  link.com_m = {0.2, 0.0, 0.0};
  link.inertia_kg_m2 = {0.05, 0.05, 0.05};
  robot.chain = Chain({link, link}, gravity);
  return robot;
}

TEST(ProveMechanics, KeepsTheEnergyOfACableOverALink) {
  for (const bool over_links : {true, false}) {
    Mechanics mechanics = started(coupled_axes(over_links, Vector3d::Zero()));
    CycleInputs push;
    push.effort[1] = 4.0;
    run(mechanics, push, 0.1);
    const double before = mechanics.energy();
    ASSERT_GT(before, 0.1);
    run(mechanics, {}, 5.0);
    EXPECT_NEAR(mechanics.energy(), before, 3e-3 * before) << over_links;
  }
}

/// Motors that do not move: links hang in their cables.
TEST(ProveMechanics, LoadsTheCableOfALinkThatAnotherCableRunsOver) {
  for (const bool over_links : {true, false}) {
    RobotPhysics robot = coupled_axes(over_links, {9.81, 0.0, 0.0});
    for (JointPhysics& joint : robot.joints) {
      joint.motor_inertia = 1e9;
      joint.cable.damping = 20.0;
    }
    Mechanics mechanics = started(robot, {0.6, 0.5, 0.0});
    run(mechanics, {}, 5.0);
    const Vector3d weight = robot.chain.weight(mechanics.joints());
    const Vector3d tension = mechanics.tensions();
    EXPECT_NEAR(tension[1], weight[1], 1e-4);
    EXPECT_NEAR(tension[0], weight[0] + (over_links ? -0.4 * weight[1] : 0.0), 1e-4);
  }
}

TEST(ProveMechanics, GainsTheWorkThatTheDriveDoes) {
  Mechanics mechanics = started(bare_axis());
  CycleInputs push;
  push.effort[0] = 2.0;
  const double from = mechanics.motors()[0];
  run(mechanics, push, 0.5);
  const double work = 2.0 * (mechanics.motors()[0] - from);
  EXPECT_NEAR(mechanics.energy(), work, 1e-3 * work);
}

TEST(ProveMechanics, SlidesAtTheCoulombLevelAgainstTheMotion) {
  for (const double sign : {-1.0, 1.0}) {
    RobotPhysics robot = bare_axis();
    robot.joints[0].motor_friction.level = 1.5;
    robot.joints[0].motor_friction.displacement = 3e-4;
    robot.joints[0].motor_friction.spread = 0.5;
    robot.joints[0].motor_friction.damping = 10.0;
    robot.joints[0].cable.damping = 4.0;
    Mechanics mechanics = started(robot);
    CycleInputs push;
    push.effort[0] = sign * 2.0;
    run(mechanics, push, 1.0);
    EXPECT_NEAR(mechanics.motor_frictions()[0], sign * 1.5, 0.01);
    // What is left of the effort accelerates the whole axis.
    const double v = mechanics.state(0, Mechanics::kMotorVelocity);
    EXPECT_NEAR(v, sign * 0.5 / 0.45 * 1.0, 0.05);
  }
}

TEST(ProveMechanics, SticksBelowBreakawayWithinTheBristles) {
  RobotPhysics robot = bare_axis();
  robot.joints[0].motor_friction.level = 1.5;
  robot.joints[0].motor_friction.displacement = 3e-4;
  robot.joints[0].motor_friction.damping = 30.0;
  robot.joints[0].cable.damping = 4.0;
  Mechanics mechanics = started(robot);
  CycleInputs push;
  for (int i = 0; i < 3000; ++i) {
    push.effort[0] = std::min(1.0, 0.5e-3 * i);
    ASSERT_TRUE(mechanics.advance(push, kMs).ok());
  }
  // A bristle bends by effort over slope; LuGre adds the slip on the way, z / (1 - z) at most.
  EXPECT_GT(mechanics.motors()[0], 3e-4 * 1.0 / 1.5);
  EXPECT_LT(mechanics.motors()[0], -3e-4 * std::log(1.0 - 1.0 / 1.5) * 1.05);
  const double held = mechanics.motors()[0];
  run(mechanics, push, 5.0);
  EXPECT_NEAR(mechanics.motors()[0], held, 2e-6);
}

TEST(ProveMechanics, GoesOnWhereFrictionThatFollowsTheLoadLosesIt) {
  RobotPhysics robot = bare_axis();
  robot.joints[0].motor_friction.load_share = 0.6;
  robot.joints[0].motor_friction.displacement = 1e-4;
  robot.joints[0].cable.damping = 4.0;
  Mechanics mechanics = started(robot);
  CycleInputs push;
  // The integrator says there that its steps have shrunk to nothing.
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3000; ++i) {
    push.effort[0] = 3.0 * std::sin(0.02 * i);
    ASSERT_TRUE(mechanics.advance(push, kMs).ok()) << i;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ProveMechanics, HasTheFrequencyOfItsCable) {
  RobotPhysics robot = bare_axis();
  Mechanics mechanics = started(robot);
  CycleInputs push;
  push.effort[0] = 5.0;
  run(mechanics, push, 0.02);
  const double omega = std::sqrt(300.0 * (1.0 / 0.4 + 1.0 / 0.05));
  int crossings = 0;
  double last = 0.0, first_s = 0.0, last_s = 0.0;
  for (int i = 0; i < 3000; ++i) {
    ASSERT_TRUE(mechanics.advance({}, kMs).ok());
    const double stretch = mechanics.motors()[0] - mechanics.joints()[0];
    if (stretch * last < 0.0) {
      (crossings == 0 ? first_s : last_s) = i * kMs;
      ++crossings;
    }
    last = stretch;
  }
  const double measured = 3.14159265 * (crossings - 1) / (last_s - first_s);
  EXPECT_NEAR(measured, omega, 0.01 * omega);
}

TEST(ProveMechanics, AgreesWithItselfAtATighterTolerance) {
  Random random(5, "tolerance");
  const NominalRobot nominal = draw_raven(random);
  Session session = exact_session(nominal);
  const Vector3d start(0.7, 1.4, 0.37);
  Vector3d loose = start, tight = start;
  for (const double tolerance : {1e-6, 1e-9}) {
    auto mechanics = Mechanics::create(session.robot, tolerance);
    ASSERT_TRUE(mechanics.ok());
    mechanics.value().place(start);
    CycleInputs push;
    push.effort = {3.0, -2.5, 20.0};
    run(mechanics.value(), push, 0.3);
    push.effort = -push.effort;
    run(mechanics.value(), push, 0.4);
    (tolerance > 1e-7 ? loose : tight) = mechanics.value().joints();
  }
  EXPECT_GT((tight - start).norm(), 0.01);
  EXPECT_LT((tight - loose).norm(), 1e-5);
}

TEST(ProveMechanics, MovesTheSameInBothEngines) {
  Random random(9, "engines");
  for (const NominalRobot& nominal : {draw_raven(random), draw_axis(random)}) {
    RobotPhysics robot = exact_session(nominal).robot;
    const Vector3d start =
        nominal.joints.size() == 3 ? Vector3d(0.7, 1.4, 0.37) : Vector3d(0.4, 0.0, 0.0);
    Mechanics own = started(robot, start);
    robot.mujoco = true;
    Mechanics mujoco = started(robot, start);
    CycleInputs push;
    push.effort = {3.0, -2.5, 20.0};
    run(own, push, 0.5);
    run(mujoco, push, 0.5);
    EXPECT_GT((own.joints() - start).norm(), 0.01);
    EXPECT_LT((own.joints() - mujoco.joints()).norm(), 1e-5);
  }
}

physics::Plant plant_of(const NominalRobot& nominal) {
  auto plant = physics::parse_plant(plant_text(nominal), "generated plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

TEST(ProveMechanics, WeighsTheArmAsTheSimulationDoes) {
  Random random(3, "weight");
  const NominalRobot nominal = draw_raven(random);
  const Chain chain = chain_of(nominal);
  physics::ArmDynamics dynamics(plant_of(nominal), physics::Arm::kGold, true);
  for (int i = 0; i < 50; ++i) {
    const Vector3d q(random.uniform(0.3, 1.2), random.uniform(0.9, 2.0), random.uniform(0.3, 0.45));
    const Vector3d v(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-0.2, 0.2));
    const ChainDynamics here = chain.at(q, v);
    EXPECT_LT((chain.weight(q) - dynamics.gravity(q)).norm(), 1e-9);
    EXPECT_LT((here.mass - dynamics.mass_matrix(q)).norm(), 1e-9);
    const Vector3d velocity_terms = here.bias - chain.weight(q);
    EXPECT_LT((velocity_terms - dynamics.coriolis(q, v)).norm(),
              2e-4 * (1.0 + velocity_terms.norm()));
  }
}

/// Follows a path with a servo and gives RMS differences of (truth - estimate) and effort between
/// the generator's robot and the simulation's, over their own RMS.
struct Agreement {
  Vector3d position, effort;
};

Agreement compare(const NominalRobot& nominal, double seconds) {
  const Session session = exact_session(nominal);
  auto simulation = physics::ArmPhysics::create(plant_of(nominal), false);
  EXPECT_TRUE(simulation.ok()) << (simulation.ok() ? "" : simulation.error().message);
  Mechanics mechanics = started(session.robot, {0.7, 1.4, 0.37});
  simulation.value().place({0.7, 1.4, 0.37});
  core::Random unused(1);
  Vector3d reduction, to_joint;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const NominalJoint& joint = nominal.joints[static_cast<std::size_t>(i)];
    reduction[i] = joint.reduction;
    to_joint[i] = joint.reduction / joint.gearbox_ratio;
  }
  const Eigen::Matrix3d motor_from_joint = Eigen::Matrix3d::Identity() - nominal.coupling;
  const auto servo = [&](const Vector3d& wanted, const Vector3d& motors, Vector3d& last) {
    Vector3d torque;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const NominalJoint& joint = nominal.joints[static_cast<std::size_t>(i)];
      torque[i] = joint.kp * (wanted[i] - motors[i]) * reduction[i] -
                  joint.kd * (motors[i] - last[i]) * reduction[i] / kMs;
    }
    last = motors;
    return torque;
  };
  Vector3d last_a = mechanics.motors(),
           last_b = simulation.value().motors_rad().cwiseQuotient(reduction);
  Vector3d position_2 = Vector3d::Zero(), effort_2 = position_2;
  Vector3d mean_a = Vector3d::Zero(), mean_b = mean_a;
  int count = 0;
  for (int i = 0; i < static_cast<int>(seconds / kMs); ++i) {
    const double t = i * kMs;
    const Vector3d desired(0.7 + 0.2 * std::sin(0.5 * t), 1.4 + 0.25 * std::sin(0.4 * t),
                           0.37 + 0.03 * std::sin(0.3 * t));
    const Vector3d wanted = motor_from_joint * desired;
    const Vector3d motors_a = mechanics.motors();
    const Vector3d motors_b = simulation.value().motors_rad().cwiseQuotient(reduction);
    const Vector3d torque_a = servo(wanted, motors_a, last_a);
    const Vector3d torque_b = servo(wanted, motors_b, last_b);
    const Vector3d y_a = mechanics.joints() - motor_from_joint.inverse() * motors_a;
    const Vector3d y_b = simulation.value().joints_ji() - motor_from_joint.inverse() * motors_b;
    mean_a = 0.99 * mean_a + 0.01 * torque_a.cwiseProduct(to_joint);
    mean_b = 0.99 * mean_b + 0.01 * torque_b.cwiseProduct(to_joint);
    if (t > 3.0) {
      position_2 += (y_a - y_b).cwiseAbs2();
      effort_2 += (mean_a - mean_b).cwiseAbs2();
      ++count;
    }
    CycleInputs inputs;
    inputs.effort = torque_a.cwiseProduct(to_joint);
    EXPECT_TRUE(mechanics.advance(inputs, kMs).ok());
    simulation.value().advance(torque_b, unused);
  }
  return {(position_2 / count).cwiseSqrt(), (effort_2 / count).cwiseSqrt()};
}

TEST(ProveMechanics, WithNothingLeftOutItsLoopIsThatOfTheSimulationToTheNoiseFloor) {
  Random random(11, "nominal loop");
  for (int i = 0; i < 3; ++i) {
    const NominalRobot nominal = draw_raven(random);
    const Agreement off = compare(nominal, 30.0);
    for (Eigen::Index j = 0; j < 3; ++j) {
      const bool prismatic = j == 2;
      EXPECT_LT(off.position[j], typical_floor(prismatic, false)) << "joint " << j;
      EXPECT_LT(off.effort[j], typical_floor(prismatic, true)) << "joint " << j;
    }
  }
}

}  // namespace
