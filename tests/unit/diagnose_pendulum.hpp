// SPDX-License-Identifier: Apache-2.0
//
// A pendulum behind a cable along three sines, predicted by shared/physics: for tests of the model,
// which shares that physics. Whether names are right is tested on recordings of other makers.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "diagnose/track/filter.hpp"
#include "physics/plant.hpp"
#include "physics/predict/predict.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;
using record::Role;

inline constexpr double kPeriodS = 0.02;
inline constexpr Index kRows = 4000;

/// One pendulum behind a cable.
inline std::string plant_text(const std::string& effects) {
  return R"(
[robot]
name = "pendulum"
gravity_m_per_s2 = [0.0, -9.8, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "one"
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
  id = "compliance"
  stiffness_n_m_per_rad = 300.0
  damping_n_m_s_per_rad = 1.0
  [[joint.effect]]
  id = "coulomb_friction"
  level_n_m = 0.5
)" + effects;
}

inline physics::Plant plant_of(const std::string& effects) {
  auto plant = physics::parse_plant(plant_text(effects), "test.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

/// The pendulum along three sines, with white noise on effort and encoder.
inline record::Recording recording_of(const physics::Plant& plant, unsigned seed) {
  physics::ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(kRows, 0.0, kPeriodS * static_cast<double>(kRows - 1));
  forced.fresh.assign(static_cast<std::size_t>(kRows), 0);
  forced.fresh.front() = 1;
  const VectorXd q = 0.4 * (0.7 * forced.t_s.array() + 0.1 * seed).sin() +
                     0.2 * (1.9 * forced.t_s.array()).sin() +
                     0.1 * (0.13 * forced.t_s.array()).sin();
  forced.motors = {{q, first_difference(q, kPeriodS), second_difference(q, kPeriodS), 0.0}};
  const auto predicted = physics::predict(plant, forced);
  EXPECT_TRUE(predicted.ok());
  record::Recording r;
  r.channels = {{"motor", "rad", Role::kMotorPosition, "one"},
                {"torque", "N_m", Role::kDriveTorque, "one"},
                {"truth", "rad", Role::kJointTruth, "one"}};
  r.samples.resize(kRows, 3);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  for (Index i = 0; i < kRows; ++i) {
    r.t_ns.push_back(std::llround(1e9 * kPeriodS * static_cast<double>(i)));
    r.samples(i, 0) = 50.0 * q[i];
    r.samples(i, 1) = (predicted->effort[0][i] + 0.02 * noise(random)) / 5.0;
    r.samples(i, 2) = predicted->position[0][i] + 1e-4 * noise(random);
  }
  r.source = "test";
  return r;
}

}  // namespace ravencal::diagnose
