// SPDX-License-Identifier: Apache-2.0
//
// The nominal robot: the content of plant.toml of a sealed case, and the truth, whose parameters
// differ from it within their tolerances. SI units, joint-referred.
#pragma once

#include <string>
#include <vector>

#include "prove/generator/session.hpp"

namespace ravencal::prove {

/// Relative tolerance of every parameter in plant.toml (the default of shared/FORMATS.md).
inline constexpr double kTolerance = 0.10;

/// Numbers of one joint's plant entry. An effect that the plant lacks is 0.
struct NominalJoint {
  std::string name;
  bool prismatic = false;
  double motor_inertia_kg_m2 = 0.0;  ///< at the shaft
  double gearbox_ratio = 1.0, reduction = 1.0;
  double mass_kg = 0.0;
  Vector3d com_m = Vector3d::Zero(), inertia_kg_m2 = Vector3d::Zero();
  double kp = 0.0, kd = 0.0, dac_limit_counts = 0.0, dac_counts_per_n_m = 1.0;
  double truth_resolution = 0.0;
  bool follows_links =
      false;  ///< its cable runs over the links that move it, not over their drives
  double stiffness = 0.0, cable_damping = 0.0;
  double joint_friction = 0.0, joint_presliding = 0.0;
  double coulomb = 0.0, viscous = 0.0, stribeck_extra = 0.0, stribeck_velocity = 0.0;
  double presliding = 0.0;
  MotionRange range;
};

struct NominalRobot {
  std::string name;
  std::vector<NominalJoint> joints;
  Vector3d gravity = Vector3d::Zero();
  Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();
  double truth_period_s = 0.0104, truth_latency_s = 0.004;
  double row_rate_hz = 100.0;
  bool says_ways = false;         ///< plant.toml has `coupling_through`
  bool states_controller = true;  ///< plant.toml has [joint.controller]
};

/// RAVEN-II, joints 1 to 3, with geometry, transmission and servo as published (uw-biorobotics/
/// raven2: defines.h, r2_kinematics.cpp, params) and drawn friction and cables.
NominalRobot draw_raven(Random& random);
/// One revolute axis with a pendulum, driven as a RAVEN joint is.
NominalRobot draw_axis(Random& random);

/// Chain of these masses; RAVEN's screws for three joints, a plain axis for one.
Chain chain_of(const NominalRobot& robot);

/// Cables of joints that others move run over links or drives, each as likely; half of the plants
/// say which.
void draw_ways(NominalRobot& robot, Random& random);

/// The same robot without noise: parameters exact where `deviation` is 0, else off by up to that
/// share of the tolerance.
Session exact_session(const NominalRobot& robot);
/// Sensor and friction noise of usual size on top.
void add_noise(Session& session, Random& random);
/// Draws every nominal parameter anew within its tolerance.
NominalRobot within_tolerance(const NominalRobot& nominal, Random& random);

/// RMS noise that add_noise() leaves in each channel, as a scale for sizes before they are
/// measured.
double typical_floor(bool prismatic, bool effort);

/// plant.toml.
std::string plant_text(const NominalRobot& robot);

}  // namespace ravencal::prove
