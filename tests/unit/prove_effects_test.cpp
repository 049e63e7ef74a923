// SPDX-License-Identifier: Apache-2.0
//
// Each effect of the sealed generator by itself: a recording with it against its twin without, on
// the same motion and noise, compared with the closed form at the first order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "prove/generator/subject.hpp"

namespace {

using namespace ravencal::prove;
using Eigen::Index;
using Eigen::VectorXd;
using ravencal::record::Recording;
using ravencal::record::Role;

constexpr double kDurationS = 60.0;

/// A quiet robot with and without an effect.
struct Twins {
  NominalRobot nominal;
  Subject subject;
  Recording with, without;
  double to_joint = 1.0;

  [[nodiscard]] VectorXd column(const Recording& r, Role role) const {
    return r.samples.col(*r.column(role, nominal.joints[subject.joint].name));
  }
  [[nodiscard]] VectorXd estimate() const { return column(without, Role::kJointEstimate); }
  /// What the effect adds to truth - estimate.
  [[nodiscard]] VectorXd position() const {
    return column(with, Role::kJointTruth) - column(with, Role::kJointEstimate) -
           column(without, Role::kJointTruth) + column(without, Role::kJointEstimate);
  }
  /// What it adds to the effort, and the joint's velocity.
  [[nodiscard]] VectorXd effort() const {
    return to_joint * (column(with, Role::kDriveTorque) - column(without, Role::kDriveTorque));
  }
  [[nodiscard]] VectorXd velocity() const {
    const VectorXd q = column(without, Role::kDesiredPosition);
    VectorXd v = VectorXd::Zero(q.size());
    for (Index i = 1; i + 1 < q.size(); ++i) v[i] = (q[i + 1] - q[i - 1]) * 50.0;
    return v;
  }
};

Twins twins(std::string_view id, double amplitude, MotionKind motion = MotionKind::kSlow,
            std::size_t joint = 0, char robot = 'a') {
  Random random(7, id);
  Twins t;
  t.nominal = robot == 'r' ? draw_raven(random) : draw_axis(random);
  const auto figures = motion_figures(t.nominal, motion, kDurationS, 4);
  t.subject = draw_subject(*kind_of(id), t.nominal, figures, kDurationS, random);
  if (robot == 'a') t.subject.joint = joint;
  t.subject.details["sign"] = 1.0;
  if (id == "stribeck_friction") t.subject.details["velocity"] = 0.08;
  if (id == "creep") t.nominal.joints[0].joint_friction = 0.0;  // the load is the weight alone
  conceal(t.subject, t.nominal);
  const NominalJoint& j = t.nominal.joints[t.subject.joint];
  t.to_joint = j.reduction / j.gearbox_ratio;
  Session base = exact_session(t.nominal);
  base.duration_s = kDurationS;
  base.motion = motion;
  Session changed = base;
  apply(t.subject, amplitude, changed);
  for (const auto& [session, to] : {std::pair{&changed, &t.with}, std::pair{&base, &t.without}}) {
    auto recording = run_session(*session, {4, 9}, {});
    EXPECT_TRUE(recording.ok()) << (recording.ok() ? "" : recording.error().message);
    *to = std::move(recording).value();
  }
  return t;
}

double rms(const VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

/// Least-squares factor of `x` in `y`, and what share of y it leaves.
std::pair<double, double> slope(const VectorXd& y, const VectorXd& x) {
  const double factor = y.dot(x) / x.squaredNorm();
  return {factor, rms(y - factor * x) / rms(y)};
}

VectorXd sign_of(const VectorXd& v, double least) {
  return v.unaryExpr([least](double x) { return x > least ? 1.0 : (x < -least ? -1.0 : 0.0); });
}

TEST(ProveEffects, AHomingOffsetIsAConstant) {
  const Twins t = twins("homing_offset", 0.004);
  EXPECT_NEAR(t.position().mean(), 0.004, 1e-5);
  EXPECT_LT(rms(t.position().array() - 0.004), 1e-4);
  EXPECT_LT(rms(t.effort()), 1e-9);
}

TEST(ProveEffects, AGainErrorGrowsWithThePosition) {
  const Twins t = twins("gain_error", 0.02);
  const auto [factor, left] = slope(t.position(), t.estimate());
  EXPECT_NEAR(factor, 0.02, 0.002);
  EXPECT_LT(left, 0.1);
}

TEST(ProveEffects, CouplingFollowsTheOtherJoint) {
  const Twins t = twins("coupling", 0.03, MotionKind::kSlow, 0, 'r');
  const Recording& r = t.without;
  const VectorXd other =
      r.samples.col(*r.column(Role::kJointEstimate, t.nominal.joints[*t.subject.from].name));
  const auto [factor, left] = slope(t.position(), other);
  EXPECT_NEAR(factor, 0.03, 0.003);
  EXPECT_LT(left, 0.1);
}

TEST(ProveEffects, ComplianceStretchesWithTheWeight) {
  const Twins t = twins("compliance", 0.003);
  const Chain chain = chain_of(t.nominal);
  VectorXd weight(t.estimate().size());
  for (Index i = 0; i < weight.size(); ++i) weight[i] = chain.weight({t.estimate()[i], 0, 0})[0];
  const auto [factor, left] = slope(t.position(), weight);
  EXPECT_NEAR(factor, -0.003, 0.0003);
  EXPECT_LT(left, 0.1);
}

TEST(ProveEffects, AGapOpensByItsWidthOnTheSideOfTheTension) {
  const Twins t = twins("backlash", 0.003);
  const VectorXd y = t.position();
  std::vector<double> magnitude(y.data(), y.data() + y.size());
  for (double& m : magnitude) m = std::abs(m);
  std::nth_element(magnitude.begin(), magnitude.begin() + y.size() / 2, magnitude.end());
  EXPECT_NEAR(magnitude[static_cast<std::size_t>(y.size() / 2)], 0.003, 2e-4);
  EXPECT_LT(y.minCoeff(), -0.0025);
  EXPECT_GT(y.maxCoeff(), 0.0025);
}

TEST(ProveEffects, FrictionBehindTheCableHoldsItsStretchAndLoadsTheDrive) {
  const Twins t = twins("joint_friction", 0.004);
  const VectorXd side = sign_of(t.velocity(), 0.01);
  const double level = 0.004 * t.nominal.joints[0].stiffness;
  EXPECT_NEAR(-t.position().dot(side) / side.squaredNorm(), 0.004, 0.0008);
  EXPECT_NEAR(t.effort().dot(side) / side.squaredNorm(), level, 0.15 * level);
}

TEST(ProveEffects, HysteresisStiffensTheCableUntilItYields) {
  const Twins t = twins("hysteresis", 0.004, MotionKind::kRich);
  // The strands hold at most k * 0.004 of the load, which is that much less stretch.
  EXPECT_GT(rms(t.position()), 0.0015);
  EXPECT_LT(t.position().cwiseAbs().maxCoeff(), 0.0045);
}

TEST(ProveEffects, CreepApproachesItsStretchWithItsTime) {
  const Twins t = twins("creep", 0.002, MotionKind::kRich);
  const Chain chain = chain_of(t.nominal);
  const double keep = std::exp(-0.01 / t.subject.details.at("time_s"));
  VectorXd slow(t.estimate().size());
  double state = 0.0;
  for (Index i = 0; i < slow.size(); ++i) {
    state = keep * state + (1.0 - keep) * chain.weight({t.estimate()[i], 0, 0})[0];
    slow[i] = state;
  }
  const Index skip = slow.size() / 3;  // the first rows remember the settling
  const auto [factor, left] =
      slope(t.position().tail(slow.size() - skip), slow.tail(slow.size() - skip));
  EXPECT_NEAR(factor, -0.002, 0.0005);
  EXPECT_LT(left, 0.5);
}

TEST(ProveEffects, APulleyOutOfTrueIsAWaveOverThePosition) {
  const Twins t = twins("eccentricity", 0.002);
  const VectorXd wave =
      (t.subject.details.at("order") * t.estimate().array() + t.subject.details.at("phase_rad"))
          .sin();
  const auto [factor, left] = slope(t.position(), wave);
  EXPECT_NEAR(factor, 0.002, 0.0003);
  EXPECT_LT(left, 0.3);
}

TEST(ProveEffects, ASlipIsAStepThatTheServoDoesNotSee) {
  const Twins t = twins("slip", 0.003);
  const auto at = static_cast<Index>(t.subject.details.at("at_s") * 100.0);
  EXPECT_LT(rms(t.position().head(at - 5)), 1e-9);
  EXPECT_NEAR(t.position().tail(t.position().size() - at - 50).mean(), 0.003, 3e-4);
}

TEST(ProveEffects, LostCountsShiftTheEstimateAndMoveTheRobot) {
  const Twins t = twins("lost_counts", 0.003);
  const auto at = static_cast<Index>(t.subject.details.at("at_s") * 100.0);
  const Index after = t.position().size() - at - 50;
  // The servo drives the joint back by what the encoder has gained.
  EXPECT_NEAR(t.position().tail(after).mean(), -0.003, 3e-4);
  const VectorXd moved =
      t.column(t.with, Role::kJointTruth) - t.column(t.without, Role::kJointTruth);
  EXPECT_NEAR(moved.tail(after).mean(), -0.003, 5e-4);
}

TEST(ProveEffects, ADelayIsProportionalToTheSpeed) {
  const Twins t = twins("delay", 0.04);
  const auto [factor, left] = slope(t.position(), t.velocity());
  EXPECT_NEAR(factor, -0.04, 0.006);
  EXPECT_LT(left, 0.45);
}

TEST(ProveEffects, DriftApproachesItsEnd) {
  const Twins t = twins("thermal_drift", 0.004);
  const double time_s = t.subject.details.at("time_s");
  EXPECT_NEAR(t.position()[t.position().size() - 1], 0.004 * (1.0 - std::exp(-kDurationS / time_s)),
              4e-4);
}

struct DriveForm {
  const char* id;
  double amplitude;
  double (*column)(const Twins&, double q, double v);
  MotionKind motion = MotionKind::kSlow;
  double left = 0.35;
};

class DriveEffect : public ::testing::TestWithParam<DriveForm> {};

TEST_P(DriveEffect, AddsItsClosedFormToTheEffortWhileSliding) {
  const DriveForm& form = GetParam();
  const Twins t = twins(form.id, form.amplitude, form.motion);
  const VectorXd v = t.velocity(), y = t.effort(), q = t.estimate();
  std::vector<double> wanted, got;
  for (Index i = 40; i + 40 < y.size(); ++i) {
    // Steady sliding: the same way for 0.3 s before and after.
    const bool steady =
        v.segment(i - 30, 61).minCoeff() > 0.01 || v.segment(i - 30, 61).maxCoeff() < -0.01;
    if (!steady) continue;
    wanted.push_back(form.column(t, q[i], v[i]));
    got.push_back(y.segment(i - 20, 41).mean());
  }
  ASSERT_GT(wanted.size(), 300U);
  const VectorXd x = Eigen::Map<VectorXd>(wanted.data(), static_cast<Index>(wanted.size()));
  const VectorXd g = Eigen::Map<VectorXd>(got.data(), static_cast<Index>(got.size()));
  const auto [factor, left] = slope(g, x);
  EXPECT_NEAR(factor, 1.0, 0.12);
  EXPECT_LT(left, form.left);
}

double side(double v) { return v > 0.0 ? 1.0 : -1.0; }
double weight_at(const Twins& t, double q) { return chain_of(t.nominal).weight({q, 0, 0})[0]; }
double friction_at(const Twins& t, double v) {
  const NominalJoint& j = t.nominal.joints[0];
  const double ratio = v / j.stribeck_velocity;
  return j.coulomb + j.stribeck_extra * std::exp(-ratio * ratio) + j.viscous * std::abs(v);
}

INSTANTIATE_TEST_SUITE_P(
    Prove, DriveEffect,
    ::testing::Values(
        DriveForm{"coulomb_friction", 1.0, [](const Twins&, double, double v) { return side(v); }},
        DriveForm{"viscous_friction", 8.0, [](const Twins&, double, double v) { return 8.0 * v; },
                  MotionKind::kRich},
        DriveForm{"stribeck_friction", 0.8,
                  [](const Twins& twin, double, double v) {
                    const double r = v / twin.subject.details.at("velocity");
                    return 0.8 * std::exp(-r * r) * side(v);
                  },
                  MotionKind::kRich, 0.6},
        DriveForm{"asymmetric_friction", 0.4,
                  [](const Twins& twin, double, double v) { return 0.4 * friction_at(twin, v); }},
        DriveForm{"load_dependent_friction", 0.3,
                  [](const Twins& twin, double q, double v) {
                    const double tension =
                        weight_at(twin, q) + twin.nominal.joints[0].joint_friction * side(v);
                    return 0.3 * std::abs(tension) * side(v);
                  }},
        DriveForm{"torque_constant", 0.2,
                  [](const Twins& twin, double q, double v) {
                    const NominalJoint& j = twin.nominal.joints[0];
                    const double needed =
                        weight_at(twin, q) + (friction_at(twin, v) + j.joint_friction) * side(v);
                    return -0.2 / 1.2 * needed;
                  }},
        DriveForm{"gravity", 0.5,
                  [](const Twins& twin, double q, double) {
                    return 0.5 * 9.81 * twin.nominal.joints[0].com_m[0] * std::sin(q);
                  }}),
    [](const auto& test) { return std::string(test.param.id); });

TEST(ProveEffects, SaturationHoldsTheMotorBackWhereTheCommandExceedsIt) {
  const Twins t = twins("saturation", 0.3, MotionKind::kRich);
  const NominalJoint& j = t.nominal.joints[0];
  const double limit =
      0.75 * (j.coulomb + j.stribeck_extra + j.joint_friction + t.subject.details.at("weight")) *
      (1.0 + 0.25 * std::log(0.35 / 0.3));
  const VectorXd command = t.to_joint * t.column(t.with, Role::kDriveTorque);
  EXPECT_GT(command.cwiseAbs().maxCoeff(), 1.1 * limit);
  EXPECT_GT(command.cwiseAbs().maxCoeff(),
            t.to_joint * t.column(t.without, Role::kDriveTorque).cwiseAbs().maxCoeff());
}

TEST(ProveEffects, AControllerGainChangesTheLawAndPulsesAreRecordedWithTheCommand) {
  const Twins gain = twins("controller_gain", 0.3);
  const NominalJoint& j = gain.nominal.joints[0];
  const auto law_residual = [&](const Twins& t, const Recording& r, double kp) {
    const VectorXd error = t.column(r, Role::kDesiredPosition) - t.column(r, Role::kJointEstimate);
    return VectorXd(t.column(r, Role::kDriveTorque) - kp * j.reduction * error +
                    j.kd * t.column(r, Role::kMotorVelocity));
  };
  EXPECT_LT(law_residual(gain, gain.without, j.kp).cwiseAbs().maxCoeff(), 5e-4);
  EXPECT_LT(law_residual(gain, gain.with, 1.3 * j.kp).cwiseAbs().maxCoeff(), 5e-4);
  const Twins pulse = twins("input_disturbance", 1.0);
  const VectorXd left = pulse.to_joint * law_residual(pulse, pulse.with, j.kp);
  for (const auto& [begin_s, end_s] : pulse.subject.interval_s)
    EXPECT_NEAR(left[static_cast<Index>(50.0 * (begin_s + end_s))], 1.0, 0.01);
}

TEST(ProveEffects, PreslidingBendsAtReversalsOnly) {
  const Twins t = twins("presliding", 0.005, MotionKind::kRich);
  const VectorXd v = t.velocity(), y = t.effort();
  double sliding = 0.0, all = 0.0, n = 0.0, m = 0.0;
  for (Index i = 60; i + 1 < y.size(); ++i) {
    const bool steady =
        v.segment(i - 60, 61).minCoeff() > 0.04 || v.segment(i - 60, 61).maxCoeff() < -0.04;
    (steady ? sliding : all) += y[i] * y[i];
    (steady ? n : m) += 1.0;
  }
  ASSERT_GT(n, 100.0);
  EXPECT_GT(all / m, 4.0 * sliding / n);
}

TEST(ProveEffects, AFlexibleMassIsARigidOneToSlowMotionAndRingsAtItsFrequency) {
  const Twins t = twins("flexible_mode", 0.08, MotionKind::kRich);
  EXPECT_GT(rms(t.position()) + rms(t.effort()), 0.01);
  RobotPhysics robot = exact_session(t.nominal).robot;
  JointPhysics& joint = robot.joints[0];
  joint.flexible_inertia = 0.08;
  const double omega = 6.2831853 * t.subject.details.at("frequency_hz");
  joint.flexible_stiffness = 0.08 * omega * omega;
  auto mechanics = Mechanics::create(robot);
  ASSERT_TRUE(mechanics.ok());
  mechanics.value().place(Vector3d::Zero());
  CycleInputs push;
  push.effort[0] = 5.0;
  double bend = 0.0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(mechanics.value().advance(push, 1e-3).ok());
    bend = std::max(bend, std::abs(mechanics.value().state(0, Mechanics::kFlexible) -
                                   mechanics.value().state(0, Mechanics::kJoint)));
  }
  EXPECT_GT(bend, 1e-4);
}

TEST(ProveEffects, APayloadWeighsWhereTheToolIs) {
  const Twins t = twins("payload", 0.5, MotionKind::kSlow, 0, 'a');
  const VectorXd lever = t.estimate().array().sin() * (0.5 * 9.81 * 0.3);
  const VectorXd weight_only = t.effort();
  const auto [factor, left] = slope(weight_only, lever);
  EXPECT_NEAR(factor, 1.0, 0.25);
}

TEST(ProveEffects, WhatIsOutsideOfTheVocabularyActsWhereItSays) {
  const Twins bump = twins("local_bump", 0.005);
  const double centre = bump.subject.details.at("centre"), width = bump.subject.details.at("width");
  double inside = 0.0, outside = 0.0;
  for (Index i = 0; i < bump.position().size(); ++i) {
    const double far = std::abs(bump.estimate()[i] - centre) / width;
    double& greatest = far < 1.0 ? inside : outside;
    if (far < 1.0 || far > 2.5) greatest = std::max(greatest, std::abs(bump.position()[i]));
  }
  EXPECT_NEAR(inside, 0.005, 5e-4);
  EXPECT_LT(outside, 5e-4);
  const Twins sway = twins("truth_sway", 0.002);
  EXPECT_NEAR(rms(sway.position()), 0.002 * std::sqrt(0.5), 2e-5);
  EXPECT_LT(rms(sway.effort()), 1e-9);
  EXPECT_GT(rms(twins("bending_arm", 0.01, MotionKind::kSlow, 0, 'r').position()), 1e-6);
  EXPECT_GT(rms(twins("wrong_joint_load", 0.5, MotionKind::kSlow, 0, 'r').effort()), 0.05);
}

TEST(ProveEffects, NoneAtAllChangesNothing) {
  for (const auto& list : {vocabulary_kinds(), outside_kinds()}) {
    for (const SubjectKind& k : list) {
      if (k.robot == 'r') continue;
      Random random(7, k.id);
      NominalRobot nominal = draw_axis(random);
      const auto figures = motion_figures(nominal, MotionKind::kSlow, 10.0, 4);
      const Subject s = draw_subject(k, nominal, figures, 10.0, random);
      conceal(s, nominal);
      Session base = exact_session(nominal);
      base.duration_s = 2.0;
      Session same = base;
      apply(s, 0.0, same);
      const auto a = run_session(base, {4, 9}, {}), b = run_session(same, {4, 9}, {});
      ASSERT_TRUE(a.ok() && b.ok());
      EXPECT_EQ((a.value().samples - b.value().samples).cwiseAbs().maxCoeff(), 0.0) << k.id;
    }
  }
}

}  // namespace
