// SPDX-License-Identifier: Apache-2.0
//
// A robot model as a plant, and a recording of another one that MuJoCo moves: simulator against
// simulator.
#pragma once

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "physics/mujoco_model.hpp"
#include "physics/robot_model/plant_of_model.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

inline physics::ModelPointer model_of_mjcf(const std::string& text) {
  physics::CompiledModel compiled = physics::compile_model(text, "robot.xml");
  EXPECT_TRUE(compiled.model) << compiled.refusal;
  return std::move(compiled.model);
}

inline physics::Plant plant_of_mjcf(const std::string& text) {
  const physics::ModelPointer model = model_of_mjcf(text);
  auto plant = physics::plant_of_model(*model, "robot.xml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return std::move(*plant);
}

/// Two sines of no common period, which a joint and a seed shift: reach 1 about 0.
inline double two_sines(double slow_hz, double t_s, int joint, double seed) {
  return 0.65 * std::sin(2.0 * M_PI * slow_hz * t_s + joint) +
         0.35 * std::sin(2.0 * M_PI * 2.3 * slow_hz * t_s + seed);
}

/// Positions and efforts at 100 Hz, logged as users do: after each step. Its actuators are asked
/// for `desired_rad(t_s, joint, seed)`.
inline record::Recording recording_of_mjcf(
    const std::string& text, const std::function<double(double, int, double)>& desired_rad,
    double seed, double duration_s) {
  constexpr double kRow_s = 0.01;
  const physics::ModelPointer model = model_of_mjcf(text);
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model.get()),
                                                               &mj_deleteData);
  const auto rows = static_cast<Eigen::Index>(duration_s / kRow_s);
  const auto steps = static_cast<int>(std::lround(kRow_s / model->opt.timestep));
  record::Recording out;
  out.source = "robot.db";
  out.samples.resize(rows, 2 * static_cast<Eigen::Index>(model->nv));
  for (int j = 0; j < model->nv; ++j) {
    const std::string joint = mj_id2name(model.get(), mjOBJ_JOINT, j);
    out.channels.push_back({joint + ".position", "rad", record::Role::kMotorPosition, joint});
    out.channels.push_back({joint + ".torque", "N_m", record::Role::kDriveTorque, joint});
    data->qpos[j] = desired_rad(0.0, j, seed);
  }
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (int step = 0; step < steps; ++step) {
      for (int j = 0; j < model->nv; ++j) data->ctrl[j] = desired_rad(data->time, j, seed);
      mj_step(model.get(), data.get());
    }
    out.t_ns.push_back(std::llround(data->time * 1e9));
    for (int j = 0; j < model->nv; ++j) {
      out.samples(row, 2 * j) = data->qpos[j];
      out.samples(row, 2 * j + 1) = data->qfrc_actuator[j];
    }
  }
  return out;
}

}  // namespace ravencal::diagnose
