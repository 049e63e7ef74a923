// SPDX-License-Identifier: Apache-2.0
//
// A small recording whose joint error is a known function of its channels.
#pragma once

#include <random>

#include "record/recording.hpp"

namespace ravencal::learn {

/// Joints "elbow" (rad) and "insertion" (m), 100 Hz. truth - estimate is linear in the torques:
/// elbow 0.10 + 0.03 tau, insertion -0.002 + 0.0005 tau, plus `curvature` * tau^2 on both.
inline record::Recording sample_arm(int rows, unsigned seed, double curvature = 0.0) {
  using record::Role;
  record::Recording arm;
  arm.source = "sample.db";
  arm.channels = {{"elbow.estimate", "rad", Role::kJointEstimate, "elbow"},
                  {"elbow.truth", "rad", Role::kJointTruth, "elbow"},
                  {"insertion.estimate", "m", Role::kJointEstimate, "insertion"},
                  {"insertion.truth", "m", Role::kJointTruth, "insertion"},
                  {"elbow.torque", "N_m", Role::kDriveTorque, "elbow"},
                  {"insertion.torque", "N", Role::kDriveTorque, "insertion"}};
  arm.samples.resize(rows, 6);
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int row = 0; row < rows; ++row) {
    arm.t_ns.push_back(row * 10'000'000LL);
    const double elbow = 1.0 + 0.5 * unit(generator);
    const double insertion = 0.38 + 0.04 * unit(generator);
    const double torque_1 = unit(generator);
    const double torque_2 = 3.0 * unit(generator);
    arm.samples.row(row) << elbow, elbow + 0.10 + 0.03 * torque_1 + curvature * torque_1 * torque_1,
        insertion, insertion - 0.002 + 0.0005 * torque_2 + 0.01 * curvature * torque_2 * torque_2,
        torque_1, torque_2;
  }
  return arm;
}

}  // namespace ravencal::learn
