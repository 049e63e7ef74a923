// SPDX-License-Identifier: Apache-2.0
//
// The other world of the sealed generator: each law against its closed form, the arm at rest and
// without drive, and recordings that are what they say.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "physics/plant.hpp"
#include "prove/generator/case.hpp"
#include "prove/generator/other/arm.hpp"

namespace {

using namespace ravencal::prove;
using Eigen::Index;
using Eigen::VectorXd;
using ravencal::record::Recording;
using ravencal::record::Role;

constexpr double kTickS = 1e-3;

TEST(ProveOtherLaws, DahlStartsWithItsSlopeAndSaturatesAtItsLevel) {
  for (const double exponent : {0.5, 1.0, 1.7}) {
    // From the level on the other side the slope is that of Dahl's law, 2^exponent times the
    // rest's.
    for (const auto& [from, factor] : {std::pair{0.0, 1.0}, {-2.0, std::pow(2.0, exponent)}}) {
      const double slope = (dahl_after(from, 2.0, 5000.0, exponent, 1e-9) - from) / 1e-9;
      EXPECT_NEAR(slope, 5000.0 * factor, 5.0 * factor) << exponent;
    }
    double effort = 0.0;
    for (int n = 0; n < 4000; ++n) effort = dahl_after(effort, 2.0, 5000.0, exponent, -1e-5);
    EXPECT_NEAR(effort, -2.0, 0.05) << exponent;
  }
  EXPECT_NEAR(dahl_after(0.0, 2.0, 5000.0, 1.0, 4e-4), 2.0 * (1.0 - std::exp(-1.0)), 1e-12);
}

TEST(ProveOtherLaws, DahlDoesNotDependOnTheStep) {
  for (const double exponent : {0.7, 1.0, 1.5}) {
    double in_steps = -1.0;
    for (int n = 0; n < 100; ++n) in_steps = dahl_after(in_steps, 2.0, 5000.0, exponent, 1e-5);
    EXPECT_NEAR(in_steps, dahl_after(-1.0, 2.0, 5000.0, exponent, 1e-3), 1e-9) << exponent;
  }
}

TEST(ProveOtherLaws, TheStribeckLevelIsHalfwayAtItsVelocity) {
  EXPECT_DOUBLE_EQ(hess_soom_level(1.0, 0.4, 0.02, 0.0), 1.4);
  EXPECT_DOUBLE_EQ(hess_soom_level(1.0, 0.4, 0.02, -0.02), 1.2);
  EXPECT_NEAR(hess_soom_level(1.0, 0.4, 0.02, 2.0), 1.0, 1e-4);
}

TEST(ProveOtherLaws, StrandsStartStiffAndYield) {
  IwanStops strands;
  EXPECT_NEAR(strands.move(200.0, 1e-3, 1e-5), 200.0 * 1e-5, 1e-12);
  double effort = 0.0;
  for (int n = 0; n < 400; ++n) effort = strands.move(200.0, 1e-3, 1e-5);
  EXPECT_NEAR(effort, 0.2, 1e-12);
  // On the way back the same elements stand again before they slide.
  EXPECT_NEAR(strands.move(200.0, 1e-3, -1e-5) - effort, -200.0 * 1e-5, 1e-12);
}

TEST(ProveOtherLaws, PlayIsFreeInsideAndSmoothAtItsEdge) {
  EXPECT_EQ(stretch_behind_play(0.0019, 0.002, 300.0, 1.0), 0.0);
  EXPECT_EQ(stretch_behind_play(0.0019, 0.0, 300.0, 1.0), 0.0019);
  const double just = stretch_behind_play(0.002 + 1e-9, 0.002, 300.0, 1.0);
  EXPECT_LT(just, 0.1 * 1e-9);  // nearly all of it presses the contact in
  const double far = stretch_behind_play(-0.02, 0.002, 300.0, 1.0);
  const double pressed = 2e-4 * std::pow(300.0 * -far, 2.0 / 3.0);
  EXPECT_NEAR(-far + pressed, 0.018, 1e-9);
}

TEST(ProveOtherLaws, CreepEndsAtItsComplianceAndPassesHalfNearItsTime) {
  PronyCreep creep;
  double at_time = 0.0;
  for (int n = 0; n < 400000; ++n) {
    if (n == 10000) at_time = creep.strain();
    creep.step(3.0, 2e-3, 10.0, 1e-3);
  }
  EXPECT_NEAR(creep.strain(), 6e-3, 1e-5);
  EXPECT_GT(at_time, 0.5 * 6e-3);
  EXPECT_LT(at_time, 0.75 * 6e-3);
}

/// One revolute axis: motor 0.4 kg m^2, link 0.05 kg m^2, cable 300 N m/rad.
RobotPhysics lone_axis(double mass_kg = 0.0) {
  RobotPhysics robot;
  JointPhysics joint;
  joint.motor_inertia = 0.4;
  joint.cable.stiffness = 300.0;
  robot.joints = {joint};
  ChainLink link;
  link.inertia_kg_m2 = {0.05, 0.05, 0.05};
  link.mass_kg = mass_kg;
  link.com_m = {0.2, 0.0, 0.0};
  robot.chain = Chain({link}, {9.81, 0.0, 0.0});
  return robot;
}

OtherArm placed(const RobotPhysics& robot, double joint_rad) {
  auto arm = OtherArm::create(robot, {});
  EXPECT_TRUE(arm.ok());
  arm.value().place({joint_rad, 0.0, 0.0});
  return std::move(arm).value();
}

TEST(ProveOtherArm, ACableAtRestStretchesByWeightOverStiffness) {
  RobotPhysics robot = lone_axis(0.5);
  robot.joints[0].motor_inertia = 1e9;  // the drive holds
  robot.joints[0].cable.damping = 20.0;
  OtherArm arm = placed(robot, 0.8);
  for (int n = 0; n < 4000; ++n) ASSERT_TRUE(arm.advance({}, kTickS).ok());
  const double weight = robot.chain.weight(arm.joints())[0];
  EXPECT_GT(weight, 0.5);
  EXPECT_NEAR(arm.motors()[0] - arm.joints()[0], weight / 300.0, 1e-7);
}

TEST(ProveOtherArm, WithoutDriveItsEnergyDoesNotGrow) {
  for (const bool rubs : {false, true}) {
    RobotPhysics robot = lone_axis();
    robot.joints[0].flexible_inertia = 0.01;
    robot.joints[0].flexible_stiffness = 50.0;
    robot.joints[0].cable.eccentricity = {0.01, 20.0, 0.3};
    if (rubs) {
      robot.joints[0].motor_friction.level = robot.joints[0].joint_friction.level = 0.2;
      robot.joints[0].cable.hysteresis = {40.0, 1e-3};
      robot.joints[0].cable.gap_half_width = 1e-3;
    }
    OtherArm arm = placed(robot, 0.0);
    CycleInputs push;
    push.effort[0] = 6.0;
    for (int n = 0; n < 200; ++n) ASSERT_TRUE(arm.advance(push, kTickS).ok());
    // The current has died away a few milliseconds later.
    for (int n = 0; n < 20; ++n) ASSERT_TRUE(arm.advance({}, kTickS).ok());
    const double before = arm.energy();
    ASSERT_GT(before, 0.3);
    double greatest = 0.0;
    for (int n = 0; n < 5000; ++n) {
      ASSERT_TRUE(arm.advance({}, kTickS).ok());
      greatest = std::max(greatest, arm.energy());
    }
    EXPECT_LT(greatest, before * 1.005) << rubs;
    if (rubs) {
      EXPECT_LT(arm.energy(), 0.1 * before);
    } else {
      EXPECT_NEAR(arm.energy(), before, 5e-3 * before);
    }
  }
}

TEST(ProveOtherArm, SlidesAtTheLevelAgainstTheMotion) {
  for (const double sign : {-1.0, 1.0}) {
    RobotPhysics robot = lone_axis();
    robot.joints[0].motor_friction.level = 1.5;
    robot.joints[0].motor_friction.displacement = 3e-4;
    robot.joints[0].cable.damping = 4.0;
    OtherArm arm = placed(robot, 0.0);
    CycleInputs push;
    push.effort[0] = sign * 2.0;
    for (int n = 0; n < 1000; ++n) ASSERT_TRUE(arm.advance(push, kTickS).ok());
    EXPECT_NEAR(arm.motor_frictions()[0], sign * 1.5, 1e-3);
    // What is left of the effort accelerates the whole axis.
    EXPECT_NEAR(arm.motor_velocities()[0], sign * 0.5 / 0.45, 0.05);
  }
}

/// A quiet session of the other world on a drawn robot.
Session quiet(const NominalRobot& nominal, double seconds) {
  Session session = exact_session(nominal);
  session.duration_s = seconds;
  session.other.integral_time_s = 0.3;
  return session;
}

TEST(ProveOtherWorld, ARecordingHasItsRateItsChannelsAndFollowsItsCommand) {
  Random random(4, "other");
  NominalRobot nominal = draw_raven(random);
  nominal.row_rate_hz = 250.0;
  for (const MotionKind motion : {MotionKind::kSlow, MotionKind::kFast, MotionKind::kOneWay}) {
    Session session = quiet(nominal, 20.0);
    session.motion = motion;
    const auto made = other_world().run(session, {4, 9}, {});
    ASSERT_TRUE(made.ok()) << made.error().message;
    const Recording& r = made.value();
    EXPECT_EQ(r.rows(), 20 * 250);
    EXPECT_EQ(r.t_ns[1] - r.t_ns[0], 4000000);
    EXPECT_EQ(r.channels.size(), 3U * 6U);
    for (const NominalJoint& joint : nominal.joints) {
      const auto of = [&](Role role) { return r.samples.col(*r.column(role, joint.name)); };
      const VectorXd desired = of(Role::kDesiredPosition);
      const VectorXd behind = desired - of(Role::kJointEstimate);
      const double range = joint.range.high - joint.range.low;
      EXPECT_LT(behind.cwiseAbs().maxCoeff(), 0.06 * range) << joint.name;
      EXPECT_LT((of(Role::kJointTruth) - of(Role::kJointEstimate)).norm(), 0.05 * desired.norm());
      // The measured current is in whole counts.
      const VectorXd counts = of(Role::kDriveTorque) * joint.dac_counts_per_n_m;
      EXPECT_LT((counts - counts.array().round().matrix()).cwiseAbs().maxCoeff(), 1e-6);
      if (motion != MotionKind::kOneWay) continue;
      const VectorXd steps = desired.tail(desired.size() - 1) - desired.head(desired.size() - 1);
      EXPECT_TRUE(steps.minCoeff() > -1e-12 || steps.maxCoeff() < 1e-12) << joint.name;
      EXPECT_GT(std::abs(desired[desired.size() - 1] - desired[0]), 0.9 * range);
    }
  }
}

TEST(ProveOtherWorld, ARobotThatIsHomedAgainRestsAndHasAnEventAndAHole) {
  Random random(4, "homed");
  const NominalRobot nominal = draw_axis(random);
  Session session = quiet(nominal, 20.0);
  session.homed_at_s = 8.0;
  const auto made = other_world().run(session, {4, 9}, {});
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->rows(), 1800);
  ASSERT_EQ(made->events.size(), 1U);
  EXPECT_EQ(made->events[0].kind, "homing");
  EXPECT_EQ(made->t_ns[800], 10000000000);
  EXPECT_EQ(made->events[0].t_ns, made->t_ns[800]);
  const VectorXd desired =
      made->samples.col(*made->column(Role::kDesiredPosition, nominal.joints[0].name));
  EXPECT_NEAR(desired[800], desired[799], 2e-5);
  const VectorXd steps = desired.tail(1799) - desired.head(1799);
  EXPECT_LT(steps.cwiseAbs().maxCoeff(), 1.01 * 0.01 * nominal.joints[0].range.fastest);
}

TEST(ProveOtherWorld, WithoutAnIntegralItsServoIsThePdLawThatThePlantStates) {
  Random random(6, "law");
  const NominalRobot nominal = draw_axis(random);
  Session session = quiet(nominal, 20.0);
  session.other.integral_time_s = 0.0;
  const auto made = other_world().run(session, {4, 9}, {});
  ASSERT_TRUE(made.ok());
  const NominalJoint& j = nominal.joints[0];
  const auto of = [&](Role role) { return made->samples.col(*made->column(role, j.name)); };
  const VectorXd law =
      j.kp * (of(Role::kDesiredPosition) * j.reduction - of(Role::kMotorPosition)) -
      j.kd * of(Role::kMotorVelocity);
  EXPECT_LT((of(Role::kDriveTorque) - law).norm(), 0.05 * law.norm());
}

TEST(ProveOtherWorld, NoneAtAllChangesNothingAndEverySubjectChangesSomething) {
  for (const auto& list : {vocabulary_kinds(), outside_kinds()}) {
    for (const SubjectKind& k : list) {
      Random random(7, k.id);
      NominalRobot nominal = k.robot == 'r' ? draw_raven(random) : draw_axis(random);
      const auto figures = motion_figures(nominal, MotionKind::kRich, 20.0, 4);
      const Subject s = draw_subject(k, nominal, figures, 20.0, random);
      const double size =
          amplitude_for(s, nominal, figures,
                        10.0 * typical_floor(nominal.joints[s.joint].prismatic, !k.stage.in_truth));
      conceal(s, nominal);
      Session base = quiet(nominal, 20.0);
      base.motion = MotionKind::kRich;
      Session same = base, changed = base;
      apply(s, 0.0, same);
      apply(s, size, changed);
      const auto run = other_world().run;
      const auto a = run(base, {4, 9}, {}), b = run(same, {4, 9}, {}), c = run(changed, {4, 9}, {});
      ASSERT_TRUE(a.ok() && b.ok() && c.ok()) << k.id;
      EXPECT_EQ((a->samples - b->samples).cwiseAbs().maxCoeff(), 0.0) << k.id;
      EXPECT_GT((a->samples - c->samples).cwiseAbs().maxCoeff(), 0.0) << k.id;
    }
  }
}

CaseOptions other_cases(WorldChoice world = WorldChoice::kOther) {
  return {.seed = 5, .duration_s = 20.0, .held_out_s = 5.0, .world = world};
}

TEST(ProveOtherWorld, TheSameSeedGivesTheSameCase) {
  const auto make = [] { return make_case(draw_case(2, other_cases()), {}); };
  const auto one = make(), same = make();
  ASSERT_TRUE(one.ok() && same.ok());
  EXPECT_EQ(one->manifest, same->manifest);
  EXPECT_EQ(one->plant, same->plant);
  const auto bits = [](const Recording& r) {
    return r.samples.unaryExpr([](double x) { return std::isnan(x) ? 1e9 : x; }).eval();
  };
  EXPECT_EQ(bits(one->recording), bits(same->recording));
  EXPECT_EQ(bits(one->held_out), bits(same->held_out));
  EXPECT_EQ(nlohmann::json::parse(one->manifest)["world"], "other");
}

TEST(ProveOtherWorld, DrawsFormsThatTheOwnOneLacksAndStatesOnlyItsControllers) {
  CaseOptions options;
  options.world = WorldChoice::kOther;
  std::set<std::string_view> motions;
  std::set<double> rates;
  int homed = 0;
  double shortest_s = 1e9, longest_s = 0.0;
  for (int number = 0; number < 100; ++number) {
    const CaseDesign design = draw_case(number, options);
    motions.insert(word_of(design.base.motion));
    homed += design.base.homed_at_s > 0.0 ? 1 : 0;
    rates.insert(design.nominal.row_rate_hz);
    shortest_s = std::min(shortest_s, design.base.duration_s);
    longest_s = std::max(longest_s, design.base.duration_s);
    EXPECT_LE(design.nominal.row_rate_hz * design.base.duration_s, 60000.0);
    const auto plant = ravencal::physics::parse_plant(plant_text(design.nominal), "case");
    ASSERT_TRUE(plant.ok()) << plant.error().message;
    const bool integral = design.base.other.integral_time_s > 0.0;
    EXPECT_EQ(plant->joints[0].controller.has_value(), !integral) << number;
    for (const Subject& s : design.subjects)
      EXPECT_FALSE(integral && s.kind->stage.word == "command") << number;
  }
  EXPECT_GT(homed, 5);
  EXPECT_LT(homed, 35);
  EXPECT_EQ(motions.size(), 4U);
  EXPECT_EQ(*rates.begin(), 50.0);
  EXPECT_EQ(*rates.rbegin(), 1000.0);
  EXPECT_LT(shortest_s, 30.0);
  EXPECT_GT(longest_s, 400.0);
}

TEST(ProveOtherWorld, BothAlternateAndLeaveTheCasesOfTheOwnOneAsTheyAre) {
  for (int number = 0; number < 6; ++number) {
    const CaseDesign both = draw_case(number, other_cases(WorldChoice::kBoth));
    const WorldChoice alone = number % 2 == 0 ? WorldChoice::kOwn : WorldChoice::kOther;
    const CaseDesign one = draw_case(number, other_cases(alone));
    EXPECT_EQ(both.world->name, word_of(alone));
    EXPECT_EQ(plant_text(both.nominal), plant_text(one.nominal));
  }
}

}  // namespace
