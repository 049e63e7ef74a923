// SPDX-License-Identifier: Apache-2.0
//
// The robot as it really is in a sealed case: microphysics that `simulate` and `diagnose` do not
// have. Quantities of a joint are referred to the joint: rad and N m, or m and N.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "prove/generator/chain.hpp"

namespace ravencal::prove {

/// A smooth hill over position, or a wave.
struct Hill {
  double height = 0.0, centre = 0.0, width = 1.0;
  [[nodiscard]] double at(double position) const {
    const double u = (position - centre) / width;
    return height == 0.0 ? 0.0 : height * std::exp(-u * u);
  }
};
struct Wave {
  double amplitude = 0.0, order = 0.0, phase_rad = 0.0;
};

/// Dry friction: LuGre (Canudas de Wit et al., IEEE TAC 1995) in up to three parallel elements,
/// which with different displacements yield one after the other (generalised Maxwell slip).
struct DryFriction {
  double level = 0.0;              ///< Coulomb level while sliding
  double stribeck_extra = 0.0;     ///< breakaway minus sliding level
  double stribeck_velocity = 1.0;  ///< in exp(-(v / v_s)^2)
  double displacement = 1e-4;      ///< of the bristles at the level
  double spread = 0.0;             ///< elements yield at (1 - spread), 1, (1 + spread) of it
  double damping = 0.0;            ///< of the bristles
  double load_share = 0.0;         ///< of the tension that passes through
  double asymmetry = 0.0;          ///< level times 1 + asymmetry forwards, 1 - asymmetry backwards
  Hill local;                      ///< further level around a place (outside of the vocabulary)
};

struct CablePhysics {
  double stiffness = 1.0;
  double damping = 0.0;
  double stiffening = 0.0;  ///< stretch w in k w sinh(s / w); 0: straight
  double gap_half_width = 0.0;
  struct Strands {
    double stiffness = 0.0, yield = 1.0;
  } hysteresis;  ///< Bouc-Wen: initial slope and stretch that saturates it
  struct Creep {
    double compliance = 0.0, time_s = 1.0;
  } creep;
  double ratio_error = 0.0;
  Wave eccentricity;
  Hill bump;
};

struct JointPhysics {
  std::string name;
  bool prismatic = false;
  double reduction = 1.0;      ///< motor rad per joint unit
  double gearbox_ratio = 1.0;  ///< motor shaft to capstan
  double motor_inertia = 1.0;  ///< at the joint
  double viscous = 0.0;
  DryFriction motor_friction;
  DryFriction joint_friction;
  CablePhysics cable;
  double torque_ratio = 0.0;  ///< relative error of the motor's torque
  Wave ripple;
  double saturation = 0.0;  ///< the amplifier clips here; 0: never
  struct Leak {
    double share = 0.0;
    Eigen::Index from = 0;
  } leak;  ///< share of another joint's tension that loads this motor
  bool follows_links =
      false;  ///< its cable runs over the links that move it, not over their drives
  double flexible_inertia = 0.0, flexible_stiffness = 0.0, flexible_damping = 0.0;
};

struct RobotPhysics {
  std::vector<JointPhysics> joints;
  Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();  ///< true; joint = motor + coupling * joints
  Chain chain;
  bool mujoco = false;  ///< rigid-body dynamics by the second engine
};

}  // namespace ravencal::prove
