// SPDX-License-Identifier: Apache-2.0
//
// Recordings of a motor that is moved from place to place and held, with physics of their own.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "record/recording.hpp"

namespace ravencal::rests_sample {

struct Wave {
  double amplitude_n_m = 0.0;
  double order = 0.0;
  double phase_rad = 0.0;
};

struct Map {
  std::vector<Wave> waves{};
  double friction_n_m = 0.001;
  double noise_n_m = 2e-4;
  double step_rad = 0.004;
  int places = 1500;      ///< there, and as many back
  double held_s = 0.15;   ///< recorded of each rest, at 100 Hz
  double hidden_s = 0.7;  ///< from one rest to the next, not recorded
  bool one_row = false;   ///< per place, held_s + hidden_s apart
  unsigned seed = 1;
};

/// At 6400 counts a turn: held by an effort with friction on the side from which the place was
/// approached, which a controller's last correction lessens by up to a third.
inline record::Recording recording_of(const Map& map) {
  constexpr double kCount_rad = 2.0 * std::numbers::pi / 6400.0;
  std::mt19937 random(map.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> slack(0.67, 1.0);
  std::vector<std::array<double, 3>> rows;
  double t_s = 0.0;
  for (int n = 0; n < 2 * map.places; ++n) {
    const bool there = n < map.places;
    const double place =
        map.step_rad * (there ? n : 2 * map.places - 1 - n) + 0.1 * map.step_rad * normal(random);
    double effort = (there ? 1.0 : -1.0) * map.friction_n_m * slack(random);
    for (const Wave& wave : map.waves)
      effort += wave.amplitude_n_m * std::sin(wave.order * place + wave.phase_rad);
    const int samples = map.one_row ? 1 : static_cast<int>(map.held_s * 100.0);
    for (int k = 0; k < samples; ++k)
      rows.push_back({t_s + 0.01 * k, kCount_rad * std::round(place / kCount_rad),
                      effort + map.noise_n_m * normal(random)});
    t_s += map.held_s + map.hidden_s;
  }
  record::Recording recording;
  recording.channels = {{"motor", "rad", record::Role::kMotorPosition, "rotor"},
                        {"torque", "N_m", record::Role::kDriveTorque, "rotor"}};
  recording.samples.resize(static_cast<Eigen::Index>(rows.size()), 2);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    recording.t_ns.push_back(std::llround(1e9 * rows[i][0]));
    recording.samples(static_cast<Eigen::Index>(i), 0) = rows[i][1];
    recording.samples(static_cast<Eigen::Index>(i), 1) = rows[i][2];
  }
  recording.source = "folder/map.csv";
  return recording;
}

/// One rotor with a little friction; `effects` is TOML inside its joint.
inline std::string rotor_text(const std::string& effects = {}) {
  return R"(
[robot]
name = "rotor"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[sensors]
motor_encoder_counts_per_rev = 6400
[[joint]]
name = "rotor"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1.0
reduction = 1.0
  [joint.drive]
  input = "torque_n_m"
  gain = 1.0
  [[joint.effect]]
  id = "coulomb_friction"
  level_n_m = 0.001
  [joint.tolerance]
  "coulomb_friction.level" = 0.5
)" + effects;
}

}  // namespace ravencal::rests_sample
