// SPDX-License-Identifier: Apache-2.0
//
// A desired position that is set to the corrected measurement must give the motor the position that
// it has: through the real ratios and coupling, to less than one count of its encoder.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>

#include "physics/plant.hpp"
#include "physics/raven_controller.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

using Eigen::Vector3d;

constexpr double kRadPerCount = 2.0 * std::numbers::pi / 4000.0;  // RAVEN-II's motor encoders

// Ranges of the joints (RAVEN-II inverse kinematics): rad, rad, m.
const Vector3d kLow(0.0, std::numbers::pi / 4.0, 0.23);
const Vector3d kHigh(std::numbers::pi / 2.0, std::numbers::pi * 0.75, 0.562);

const physics::Plant& plant() {
  static const physics::Plant plant = [] {
    auto loaded = physics::load_plant(RAVENCAL_SOURCE_DIR "/tools/plants/raven2.toml");
    EXPECT_TRUE(loaded.ok()) << loaded.error().message;
    return std::move(loaded).value();
  }();
  return plant;
}

/// Any linear model of the three joints whose corrections are below `largest_ji` in that range.
model::CalibrationModel any_model(std::mt19937_64& random, const Vector3d& largest_ji) {
  model::CalibrationModel model =
      make_model({plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion")}, {});
  model.input.mean = (kLow + kHigh) / 2.0;
  model.input.scale = (kHigh - kLow) / 2.0;
  model.input_min = kLow;
  model.input_max = kHigh;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (Eigen::Index j = 0; j < 3; ++j) {
    const Vector3d slope = Vector3d::NullaryExpr([&] { return uniform(random); });
    const double offset = uniform(random);
    const double size = slope.cwiseAbs().sum() + std::abs(offset);
    model.layers[0].weights.row(j) = (slope / size).cast<float>();
    model.layers[0].biases[j] = static_cast<float>(offset / size);
  }
  model.output.mean.setZero();
  model.output.scale = largest_ji;
  return model;
}

/// As the controller holds it: single precision at every stage.
Vector3d in_floats(const Vector3d& values) { return values.cast<float>().cast<double>(); }

RC_GTEST_PROP(ControlPair, GivesTheMotorCommandBackToLessThanACount, ()) {
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  Rig rig([](ravencal_config& config) {
    for (float& rate : config.slew_ji_per_s) rate = 1e6F;
    for (float& rate : config.max_correction_rate_ji_per_s) rate = 1e6F;
    config.max_encoder_step_counts = 0;
  });
  const auto& limits = rig.config.max_correction_ji;
  rig.load(any_model(random, 0.99 * Vector3d(limits[0], limits[1], limits[2])));
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const auto n = static_cast<Eigen::Index>(j);
    rig.state.arm[0].jpos_ji[j] = static_cast<float>((kLow[n] + kHigh[n]) / 2.0);
  }
  rig.enable();
  RC_ASSERT(rig.tick_until(RAVENCAL_STATE_ACTIVE, 200));
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    // Any joints in range, at whole counts of the motors.
    const Vector3d wanted =
        kLow + Vector3d::NullaryExpr([&] { return share(random); }).cwiseProduct(kHigh - kLow);
    const Vector3d counts =
        (physics::motors_from_joints(plant(), wanted) / kRadPerCount).array().round();
    const Vector3d joints =
        in_floats(physics::joints_from_motors(plant(), in_floats(counts * kRadPerCount)));
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      rig.state.arm[0].jpos_ji[j] = static_cast<float>(joints[static_cast<Eigen::Index>(j)]);
    }
    RC_ASSERT(rig.tick() == RAVENCAL_OK);
    RC_ASSERT(rig.output.state == RAVENCAL_STATE_ACTIVE);

    float uncorrected[RAVENCAL_JOINTS];
    rig.api().uncorrect_desired(rig.instance.get(), rig.output.jpos_ji, uncorrected);
    const Vector3d back = Eigen::Map<const Eigen::Vector3f>(uncorrected).cast<double>();
    const Vector3d command = in_floats(physics::motors_from_joints(plant(), back));
    const double worst = (command / kRadPerCount - counts).cwiseAbs().maxCoeff();
    RC_ASSERT(worst < 1.0);

    // Without the inverse, a correction of a degree would be hundreds of counts.
    const Vector3d corrected = Eigen::Map<const Eigen::Vector3f>(rig.output.jpos_ji).cast<double>();
    const double correction = std::abs(static_cast<double>(rig.output.correction_ji[0]));
    const Vector3d wrong = physics::motors_from_joints(plant(), corrected);
    RC_ASSERT(correction < 1e-3 || (wrong / kRadPerCount - counts).cwiseAbs().maxCoeff() > 50.0);
  }
}

}  // namespace
}  // namespace ravencal::test
