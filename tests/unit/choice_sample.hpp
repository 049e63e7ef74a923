// SPDX-License-Identifier: Apache-2.0
//
// An elbow whose error follows a known law, and what `train` chooses for it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "choice/choose.hpp"
#include "learn/evaluate.hpp"

namespace ravencal::choice {

using record::Recording;
using record::Role;

inline constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

/// Error of an elbow, from its position, its play of half-width 0.1 and its torque.
using ErrorLaw = std::function<double(double position, double play, double torque)>;

/// An elbow that moves to and fro with falling and rising amplitude at 100 Hz, a torque, and
/// channels that must not become inputs. The law's noise is 0.001 rad.
inline Recording elbow(int rows, unsigned seed, const ErrorLaw& law) {
  Recording arm;
  arm.source = "elbow.db";
  arm.channels = {{"elbow.estimate", "rad", Role::kJointEstimate, "elbow"},
                  {"elbow.truth", "rad", Role::kJointTruth, "elbow"},
                  {"elbow.torque", "N_m", Role::kDriveTorque, "elbow"},
                  {"elbow.sensor", "N_m", Role::kLoad, "elbow"},
                  {"elbow.desired", "rad", Role::kDesiredPosition, "elbow"},
                  {"elbow.speed", "rad_per_s", Role::kMotorVelocity, "elbow"}};
  arm.samples.resize(rows, 6);
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  double play = 0.0;
  double torque = 0.0;
  for (int row = 0; row < rows; ++row) {
    const double t = 0.01 * row;
    const double position = (0.6 + 0.3 * std::sin(0.11 * t + seed)) * std::sin(0.9 * t + seed);
    play = row == 0 ? position : std::clamp(play, position - 0.1, position + 0.1);
    torque += 0.02 * (unit(generator) - torque);
    const double error = law(position, play, torque) + 0.001 * unit(generator);
    arm.t_ns.push_back(row * 10'000'000LL);
    arm.samples.row(row) << position, position + error, torque, error, position + 0.1 * error, 0.0;
  }
  return arm;
}

inline const ErrorLaw kLinear = [](double q, double, double) { return 0.05 + 0.1 * q; };
inline const ErrorLaw kPlay = [](double q, double play, double) { return 0.05 + 0.4 * (play - q); };
inline const ErrorLaw kCurve = [](double q, double, double) { return 0.2 * std::sin(3.0 * q); };

inline bool go_on(double, const std::string&) { return true; }

inline core::Result<Choice> choose(const std::vector<Recording>& recordings,
                                   const ChoiceOptions& options = {}) {
  std::vector<const Recording*> pointers;
  for (const Recording& recording : recordings) pointers.push_back(&recording);
  return choose_model(pointers, options, go_on);
}

inline double rmse_on(const model::CalibrationModel& model, const Recording& recording) {
  const Recording* const recordings[] = {&recording};
  const auto evaluation = learn::evaluate(model, recordings);
  EXPECT_TRUE(evaluation.ok()) << evaluation.error().message;
  return evaluation->joints[0].calibrated.rmse;
}

/// Names of the chosen candidates.
inline std::string chosen(const JointChoice& joint) {
  std::string names;
  for (const TriedModel& tried : joint.tried) {
    if (tried.weight > 0.0) names += tried.name + ";";
  }
  return names;
}

}  // namespace ravencal::choice
