// SPDX-License-Identifier: Apache-2.0
//
// One joint's drive as one rigid body: motor, transmission and link move together under an effort,
// against friction and weight. A template over the number type, so that simulations run it in
// double and fits differentiate it (Ceres jets). Friction is a bristle of limited deflection (LuGre
// without its own damping) and is solved implicitly: any step is stable. Units: the joint's.
#pragma once

#include <cmath>

#include "physics/plant.hpp"

namespace ravencal::physics {

template <typename T>
struct DriveNumbers {
  T inertia{1.0};            ///< kg m^2 or kg, > 0
  T weight_scale{1.0};       ///< of the link's weight in the load that the caller passes
  T torque_ratio{0.0};       ///< the drive gives 1 + ratio of the effort asked
  T level{0.0};              ///< Coulomb
  T load_share{0.0};         ///< of the load, on top of the level
  T stribeck_extra{0.0};     ///< on top at rest
  T stribeck_velocity{1.0};  ///< at which half of the extra is gone, > 0
  T presliding{1e-4};        ///< deflection at which friction is fully built up, > 0
  T viscous{0.0};
  T asymmetry{0.0};         ///< half the difference of damping between the directions
  T asymmetric_level{0.0};  ///< half the difference of dry friction between them
  T ripple{0.0};
  T ripple_order{0.0};
  T ripple_phase{0.0};
  T weight{0.0};  ///< of what no link states
  T weight_phase{0.0};
  T offset{0.0};  ///< constant part of the effort asked that moves nothing
};

/// A number that a fit may change.
enum class DriveField {
  kInertia,
  kWeight,
  kTorqueRatio,
  kLevel,
  kViscous,
  kAsymmetry,
  kStribeckExtra,
  kPresliding,
  kLoadShare,
  kRipple,
  kRipplePhase,
  kOffset,
};
inline constexpr int kDriveFields = 12;

/// `n`: DriveNumbers, const or not.
template <typename Numbers>
auto& field_of(Numbers& n, DriveField field) {
  switch (field) {
    case DriveField::kInertia:
      return n.inertia;
    case DriveField::kWeight:
      return n.weight_scale;
    case DriveField::kTorqueRatio:
      return n.torque_ratio;
    case DriveField::kLevel:
      return n.level;
    case DriveField::kViscous:
      return n.viscous;
    case DriveField::kAsymmetry:
      return n.asymmetry;
    case DriveField::kStribeckExtra:
      return n.stribeck_extra;
    case DriveField::kPresliding:
      return n.presliding;
    case DriveField::kLoadShare:
      return n.load_share;
    case DriveField::kRipple:
      return n.ripple;
    case DriveField::kRipplePhase:
      return n.ripple_phase;
    case DriveField::kOffset:
      break;
  }
  return n.offset;
}

/// Numbers of a plant's joint; `inertia` of motor and link at the joint. Where the plant does not
/// say over which displacement friction builds up, it is `least_presliding`.
DriveNumbers<double> drive_numbers(const Joint& joint, double inertia, double least_presliding);

template <typename T>
struct DriveState {
  T position{0.0};
  T velocity{0.0};
  T bristle{0.0};  ///< deflection over presliding, -1 to 1
};

/// What acts on a drive over a step: `push` whatever its new velocity, and `drag` per unit of that
/// against it.
template <typename T>
struct DrivePush {
  T push, drag;
};

/// Under `effort`; `load` is the effort that holds the link.
template <typename T>
DrivePush<T> push_of_drive(const DriveNumbers<T>& n, const T& effort, const T& load, double dt_s,
                           const DriveState<T>& state) {
  using std::abs;
  using std::sin;
  const T& v = state.velocity;
  const T ratio = v / n.stribeck_velocity;
  const T level = n.level + n.load_share * abs(load) + n.stribeck_extra / (1.0 + ratio * ratio);
  const T yielding = 1.0 + abs(v) * dt_s / n.presliding;
  T push = (1.0 + n.torque_ratio) * (effort - n.offset) - load - n.asymmetry * abs(v) -
           n.asymmetric_level * abs(state.bristle) - level * state.bristle / yielding;
  if (n.ripple != T(0.0)) push -= n.ripple * sin(n.ripple_order * state.position + n.ripple_phase);
  if (n.weight != T(0.0)) push -= n.weight * sin(state.position + n.weight_phase);
  const T drag = n.viscous + level * dt_s / (n.presliding * yielding);
  return {push, drag};
}

/// Moves bristle and position on with the velocity that the state has got.
template <typename T>
void move_drive(const DriveNumbers<T>& n, double dt_s, DriveState<T>& state) {
  using std::abs;
  const T moved = state.velocity * dt_s / n.presliding;
  state.bristle = (state.bristle + moved) / (1.0 + abs(moved));
  state.position += dt_s * state.velocity;
}

/// Moves the state on by `dt_s` under `effort`, less `damping` times the velocity at the end of the
/// step; `load` is the effort that holds the link.
template <typename T>
void step_drive(const DriveNumbers<T>& n, const T& effort, const T& load, double dt_s,
                DriveState<T>& state, const T& damping = T(0.0)) {
  auto [push, drag] = push_of_drive(n, effort, load, dt_s, state);
  drag += (1.0 + n.torque_ratio) * damping;
  state.velocity = (state.velocity + dt_s / n.inertia * push) / (1.0 + dt_s / n.inertia * drag);
  move_drive(n, dt_s, state);
}

}  // namespace ravencal::physics
