// SPDX-License-Identifier: Apache-2.0
//
// The margins of the loop through correction and servo, against what can be computed by hand and
// against a simulation in the time domain that shares only the numbers of the plant.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "loop/margins.hpp"
#include "physics/arm_dynamics.hpp"
#include "physics/plant.hpp"
#include "physics/plant_effort.hpp"
#include "physics/raven_controller.hpp"

namespace ravencal::loop {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

const Vector3d kPosture(0.5, 1.6, 0.40);

physics::Plant raven() {
  auto plant = physics::load_plant(std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return *plant;
}

/// e = gains * inputs, in SI units; outputs are joints 1 to 3.
model::CalibrationModel linear_model(const std::vector<model::FeatureSpec>& features,
                                     const MatrixXd& gains) {
  const auto n = static_cast<Index>(features.size());
  model::CalibrationModel model;
  model.features = features;
  model.input = {Eigen::VectorXd::Zero(n), Eigen::VectorXd::Ones(n)};
  model.layers = {{gains.cast<float>(), Eigen::VectorXf::Zero(3), model::Activation::kLinear}};
  model.output = {Eigen::VectorXd::Zero(3), Eigen::VectorXd::Ones(3)};
  model.outputs = {{"shoulder", "jpos.shoulder", "rad"},
                   {"elbow", "jpos.elbow", "rad"},
                   {"insertion", "jpos.insertion", "m"}};
  return model;
}

Margins margins_of(const physics::Plant& plant, const std::vector<model::FeatureSpec>& features,
                   const MatrixXd& gains, ServoOptions options = {}) {
  auto servo = ServoLoop::create(plant, options);
  EXPECT_TRUE(servo.ok()) << servo.error().message;
  OperatingPoints points;
  points.inputs_si = model::FeatureMatrix::Zero(1, static_cast<Index>(features.size()));
  points.joints_ji.resize(1, 3);
  points.joints_ji.row(0) = kPosture.transpose();
  return margins(linear_model(features, gains), points, *servo);
}

/// Motors so heavy that they do not move within a test: tau = -Kp C e, nothing else.
physics::Plant immovable() {
  physics::Plant plant = raven();
  for (physics::Joint& joint : plant.joints) joint.motor_inertia_kg_m2 = 1e9;
  return plant;
}

TEST(Margins, OfImmovableMotorsAreThoseOfHand) {
  // L = -g kp c / z with kp = 0.3 N m/rad and c = 121.522 rad/rad. For g > 0 that is positive at
  // half the control rate, where 1/z is -1; the loop rings there from g = 1 / 36.4566 on.
  const double kp_c = 0.3 * 121.522074965;
  MatrixXd gain = MatrixXd::Zero(3, 1);
  gain(1, 0) = 0.5 / kp_c;
  const Margins half = margins_of(immovable(), {{"tau.elbow"}}, gain);
  EXPECT_NEAR(half.gain.value, 2.0, 1e-4);
  EXPECT_NEAR(half.gain.frequency_hz, 500.0, 1e-6);
  EXPECT_EQ(half.phase_rad.value, std::numbers::pi) << "|L| = 0.5 everywhere";
  gain(1, 0) = 4.0 / kp_c;
  EXPECT_NEAR(margins_of(immovable(), {{"tau.elbow"}}, gain).gain.value, 0.25, 1e-4);
  // A velocity of motors that do not move is none.
  EXPECT_GT(margins_of(immovable(), {{"mvel.elbow"}}, gain).gain.value, 1e3);
}

TEST(Margins, OfTheDesiredMotorsAreThoseOfHandAtEveryFrequency) {
  // mpos_d = -c e a cycle ago, whatever the servo does: L = -g c / z.
  MatrixXd gain = MatrixXd::Zero(3, 1);
  gain(0, 0) = 0.25 / 136.196255507;
  const Margins quarter = margins_of(raven(), {{"mpos_d.shoulder"}}, gain);
  EXPECT_NEAR(quarter.gain.value, 4.0, 1e-4);
  EXPECT_NEAR(quarter.gain.frequency_hz, 500.0, 1e-6);
  // For g < 0 it is positive at 0 Hz: the correction runs away slowly.
  const Margins away = margins_of(raven(), {{"mpos_d.shoulder"}}, -gain);
  EXPECT_NEAR(away.gain.value, 4.0, 1e-4);
  EXPECT_EQ(away.gain.frequency_hz, 0.0);
  // A lag of 9 more cycles turns 500 Hz into 50 Hz: z^-10 = -1.
  model::FeatureSpec lagged{"mpos_d.shoulder", model::Transform::kLag, 9};
  model::CalibrationModel model = linear_model({lagged}, gain);
  model.row_period_s = 1e-3;
  auto servo = ServoLoop::create(raven());
  ASSERT_TRUE(servo.ok());
  OperatingPoints points{model::FeatureMatrix::Zero(1, 1), kPosture.transpose()};
  const Margins late = margins(model, points, *servo);
  EXPECT_NEAR(late.gain.value, 4.0, 0.01);
}

TEST(Margins, OfTwoCyclesOfTheDesiredMotorsAreThoseOfHand) {
  // L = -g c (1/z + 1/z^2), of size 2 g c cos(wT/2) and angle pi - 1.5 wT. With g c = 1/sqrt(2) the
  // size is 1 at wT = pi/2 (250 Hz), where the angle is 45 deg; the angle is 0 at wT = 2 pi / 3
  // (333 Hz), where the size is 1/sqrt(2).
  const double g = 1.0 / (std::numbers::sqrt2 * 136.196255507);
  MatrixXd gains = MatrixXd::Zero(3, 2);
  gains.row(0) << g, g;
  model::CalibrationModel model =
      linear_model({{"mpos_d.shoulder"}, {"mpos_d.shoulder", model::Transform::kLag, 1}}, gains);
  model.row_period_s = 1e-3;
  auto servo = ServoLoop::create(raven());
  ASSERT_TRUE(servo.ok());
  const Margins found =
      margins(model, {model::FeatureMatrix::Zero(1, 2), kPosture.transpose()}, *servo);
  // The grid's steps are 4 %; between them the locus is taken for straight.
  EXPECT_NEAR(found.gain.value, std::numbers::sqrt2, 0.01);
  EXPECT_NEAR(found.gain.frequency_hz, 1000.0 / 3.0, 3.0);
  EXPECT_NEAR(found.phase_rad.value, std::numbers::pi / 4.0, 0.01);
  EXPECT_NEAR(found.phase_rad.frequency_hz, 250.0, 3.0);
  EXPECT_FALSE(found.enough());
}

TEST(Margins, OfAMeanOfTheDesiredMotorsAreThoseOfHand) {
  // The mean of gain a turns L = -k / z into -k a / (z - (1 - a)), which is real at 0 and 500 Hz
  // only: -k, and k a / (2 - a).
  constexpr double kLoop = 0.25;
  MatrixXd gain = MatrixXd::Zero(3, 1);
  gain(0, 0) = kLoop / 136.196255507;
  constexpr float kTimeConstantS = 0.004F;
  const double a = 1.0 - std::exp(-1.0 / 4.0);
  const model::FeatureSpec mean{"mpos_d.shoulder", model::Transform::kMean, 0, 0.0F,
                                kTimeConstantS};
  const Margins found = margins_of(raven(), {mean}, gain);
  EXPECT_NEAR(found.gain.value, (2.0 - a) / (a * kLoop), 1e-2);
  EXPECT_NEAR(found.gain.frequency_hz, 500.0, 1e-6);
  EXPECT_NEAR(margins_of(raven(), {mean}, -gain).gain.value, 1.0 / kLoop, 1e-3);
  // A channel below 0 turns the sign of the mean of its size.
  const model::FeatureSpec of_abs{"mpos_d.shoulder", model::Transform::kMeanOfAbs, 0, 0.0F,
                                  kTimeConstantS};
  for (const double sign : {1.0, -1.0}) {
    const Margins worst = margins_of(raven(), {of_abs}, sign * gain);
    EXPECT_NEAR(worst.gain.value, 1.0 / kLoop, 1e-3);
    EXPECT_EQ(worst.gain.frequency_hz, 0.0);
  }
}

TEST(Margins, OfAMeanOverTravelAreThoseOfItsChannelAtOnce) {
  MatrixXd gain = MatrixXd::Zero(3, 1);
  gain(0, 0) = 0.25 / 136.196255507;
  const Margins at_once = margins_of(raven(), {{"mpos_d.shoulder"}}, gain);
  const model::FeatureSpec mean{
      "mpos_d.shoulder", model::Transform::kTravelMean, 0, 0.0F, 0.0F, 0.5F, "jpos.shoulder"};
  const Margins found = margins_of(raven(), {mean}, gain);
  EXPECT_EQ(found.gain.value, at_once.gain.value);
  EXPECT_EQ(found.gain.frequency_hz, at_once.gain.frequency_hz);
  EXPECT_EQ(found.phase_rad.value, at_once.phase_rad.value);
  model::FeatureSpec of_abs = mean;
  of_abs.transform = model::Transform::kTravelMeanOfAbs;
  const Margins worst = margins_of(raven(), {of_abs}, gain);
  EXPECT_EQ(worst.gain.value,
            std::min(at_once.gain.value, margins_of(raven(), {mean}, -gain).gain.value));
  EXPECT_EQ(margins_of(raven(), {of_abs}, -gain).gain.value, worst.gain.value);
}

TEST(Margins, AreEndlessWithoutInputsThatAnswer) {
  const Margins none =
      margins_of(raven(), {{"tau.wrist"}, {"runlevel"}, {"other.tau.elbow"}}, MatrixXd::Ones(3, 3));
  EXPECT_EQ(none.gain.value, std::numeric_limits<double>::infinity());
  EXPECT_EQ(none.phase_rad.value, std::numbers::pi);
  EXPECT_TRUE(none.enough());
}

TEST(Margins, NameWhatTheyLeaveOut) {
  const Margins some = margins_of(raven(), {{"jac_vel.0"}, {"jpos.elbow"}}, MatrixXd::Zero(3, 2));
  EXPECT_EQ(some.left_out, std::vector<std::string>{"jac_vel.0"});
  EXPECT_NE(describe(some).find("jac_vel.0"), std::string::npos);
}

TEST(Margins, NeedAServoAndACable) {
  physics::Plant plant = raven();
  plant.joints[1].controller.reset();
  const auto servo = ServoLoop::create(plant);
  ASSERT_FALSE(servo.ok());
  EXPECT_NE(servo.error().message.find("'elbow'"), std::string::npos);
}

/// Motors, cables and links by fourth-order Runge-Kutta, the servo and the correction once a cycle:
/// no matrix exponential, no transform, no eigenvalue.
class TimeDomain {
 public:
  explicit TimeDomain(const physics::Plant& plant)
      : plant_(plant), dynamics_(plant, physics::Arm::kGold, true) {
    inverse_mass_ = dynamics_.mass_matrix(kPosture).inverse();
    Matrix3d coupling;
    for (Index i = 0; i < 3; ++i) {
      for (Index k = 0; k < 3; ++k) {
        coupling(i, k) =
            physics::coupling_of(plant, static_cast<std::size_t>(i), static_cast<std::size_t>(k));
      }
      gain_[i] = 1.0 + number(i, "gain_error", "ratio");
    }
    if (plant.joints[1].coupling_through == physics::Through::kLink)
      by_link_ = coupling;
    else
      couple_ = (Matrix3d::Identity() - coupling).inverse();
  }

  /// Largest correction of joint units times `weights` in the last of three equal spans over that
  /// in the second: above 1 it grows. Inputs in the order tau, mvel, jpos, mpos_d of joints 1 to 3.
  double growth(const MatrixXd& gains, double duration_s) {
    q_.setZero(), y_.setZero(), w_.setZero(), v_.setZero();
    q_[0] = q_[1] = 1e-6, q_[2] = 1e-7;
    Vector3d read = Vector3d::Zero(), aged = Vector3d::Zero(), before = Vector3d::Zero();
    Vector3d tau = Vector3d::Zero(), wanted = Vector3d::Zero();
    const int cycles = static_cast<int>(duration_s * 1000.0);
    double spans[3] = {};
    for (int cycle = 0; cycle < cycles; ++cycle) {
      before = aged;
      aged = read;  // what was read a cycle ago
      for (Index i = 0; i < 3; ++i) read[i] = q_[i] * joint(i).reduction;
      const Vector3d speed = (aged - before) / 1e-3;
      Eigen::VectorXd inputs(12);
      inputs << tau, speed, physics::joints_from_motors(plant_, aged), wanted;
      const Vector3d e = gains * inputs;
      wanted = physics::motors_from_joints(plant_, -e);
      for (Index i = 0; i < 3; ++i) {
        tau[i] = joint(i).controller->kp_n_m_per_rad * (wanted[i] - aged[i]) -
                 joint(i).controller->kd_n_m_s_per_rad * speed[i];
      }
      for (int step = 0; step < kSteps; ++step) advance(tau, 1e-3 / kSteps);
      const double size = std::abs(e[0]) + std::abs(e[1]) + 10.0 * std::abs(e[2]);
      double& span = spans[3 * cycle / cycles];
      span = std::max(span, size);
      if (size > 1e6) return std::numeric_limits<double>::infinity();
    }
    return spans[2] / spans[1];
  }

 private:
  static constexpr int kSteps = 10;
  struct Rates {
    Vector3d w, v, a, b;
  };

  [[nodiscard]] const physics::Joint& joint(Index i) const {
    return plant_.joints[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double number(Index i, const char* effect, const char* name) const {
    return joint(i).parameter(effect, name);
  }

  Rates rates(const Vector3d& tau, const Vector3d& q, const Vector3d& y, const Vector3d& w,
              const Vector3d& v) const {
    const Vector3d drive = couple_ * gain_.cwiseProduct(q) + by_link_ * y;
    const Vector3d drive_speed = couple_ * gain_.cwiseProduct(w) + by_link_ * v;
    Vector3d tension;
    for (Index i = 0; i < 3; ++i) {
      tension[i] = number(i, "compliance", "stiffness") * (drive[i] - y[i]) +
                   number(i, "compliance", "damping") * (drive_speed[i] - v[i]);
    }
    const Vector3d reaction = gain_.cwiseProduct(couple_.transpose() * tension);
    Vector3d a;
    for (Index i = 0; i < 3; ++i) {
      const double inertia = joint(i).motor_inertia_kg_m2 * joint(i).reduction * joint(i).reduction;
      const double effort = tau[i] * joint(i).reduction / joint(i).gearbox_ratio;
      a[i] = (effort - number(i, "viscous_friction", "damping") * w[i] - reaction[i]) / inertia;
    }
    return {w, v, a, inverse_mass_ * (tension - by_link_.transpose() * tension)};
  }

  void advance(const Vector3d& tau, double h) {
    const Rates k1 = rates(tau, q_, y_, w_, v_);
    const auto at = [&](const Rates& k, double s) {
      return rates(tau, q_ + s * k.w, y_ + s * k.v, w_ + s * k.a, v_ + s * k.b);
    };
    const Rates k2 = at(k1, h / 2), k3 = at(k2, h / 2), k4 = at(k3, h);
    q_ += h / 6 * (k1.w + 2 * k2.w + 2 * k3.w + k4.w);
    y_ += h / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v);
    w_ += h / 6 * (k1.a + 2 * k2.a + 2 * k3.a + k4.a);
    v_ += h / 6 * (k1.b + 2 * k2.b + 2 * k3.b + k4.b);
  }

  const physics::Plant& plant_;
  physics::ArmDynamics dynamics_;
  Matrix3d inverse_mass_;
  Matrix3d couple_ = Matrix3d::Identity();  ///< cables that follow other drives
  Matrix3d by_link_ = Matrix3d::Zero();     ///< cables that follow other links
  Vector3d gain_;
  Vector3d q_, y_, w_, v_;
};

std::vector<model::FeatureSpec> time_domain_features() {
  std::vector<model::FeatureSpec> features;
  for (const char* field : {"tau", "mvel", "jpos", "mpos_d"}) {
    for (const char* joint : {"shoulder", "elbow", "insertion"}) {
      features.push_back({std::string(field) + "." + joint});
    }
  }
  return features;
}

/// Gains of which the loop oscillates somewhere: 3 x 12, columns as time_domain_features().
struct Case {
  const char* what;
  MatrixXd gains;
};

std::vector<Case> cases() {
  const auto zero = [] { return MatrixXd(MatrixXd::Zero(3, 12)); };
  std::vector<Case> cases;
  Case softness{"torque as a cable stretches: corrections against the torque", zero()};
  softness.gains(0, 0) = -0.06;
  softness.gains(1, 1) = -0.07;
  softness.gains(2, 2) = -0.006;
  cases.push_back(softness);
  Case forwards{"torque the other way", zero()};
  forwards.gains(0, 0) = 0.02;
  forwards.gains(1, 1) = 0.01;
  cases.push_back(forwards);
  Case crosswise{"torques of other joints", zero()};
  crosswise.gains(0, 1) = 0.05;
  crosswise.gains(1, 0) = -0.05;
  cases.push_back(crosswise);
  Case damping{"motor velocity", zero()};
  damping.gains(0, 3) = 0.002;
  damping.gains(1, 4) = -0.002;
  cases.push_back(damping);
  Case mixed{"a bit of all", zero()};
  std::srand(3);
  mixed.gains = MatrixXd::Random(3, 12);
  mixed.gains.leftCols(3) *= 0.02;
  mixed.gains.middleCols(3, 3) *= 0.001;
  mixed.gains.middleCols(6, 3) *= 0.1;
  mixed.gains.rightCols(3) *= 0.001;
  mixed.gains.row(2) *= 0.1;
  cases.push_back(mixed);
  return cases;
}

/// With cables that follow the drives or the links of other joints.
class MarginsOfRouting : public testing::TestWithParam<physics::Through> {};

TEST_P(MarginsOfRouting, TellFromWhichGainOnASimulationOscillates) {
  physics::Plant plant = raven();
  for (physics::Joint& joint : plant.joints) joint.coupling_through = GetParam();
  TimeDomain simulation(plant);
  for (const Case& test : cases()) {
    const Margins found = margins_of(plant, time_domain_features(), test.gains);
    ASSERT_TRUE(std::isfinite(found.gain.value)) << test.what;
    const double limit = found.gain.value;
    EXPECT_LT(simulation.growth(0.97 * limit * test.gains, 12.0), 1.0)
        << test.what << ": should calm down below a factor of " << limit << " ("
        << found.gain.frequency_hz << " Hz)";
    EXPECT_GT(simulation.growth(1.03 * limit * test.gains, 12.0), 1.0)
        << test.what << ": should grow above a factor of " << limit << " ("
        << found.gain.frequency_hz << " Hz)";
  }
}

INSTANTIATE_TEST_SUITE_P(Cables, MarginsOfRouting,
                         testing::Values(physics::Through::kDrive, physics::Through::kLink));

}  // namespace
}  // namespace ravencal::loop
