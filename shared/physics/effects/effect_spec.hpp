// SPDX-License-Identifier: Apache-2.0
//
// The vocabulary of effects that a plant may name, with the parameters of each. One table, used by
// the plant reader (which keys are allowed, with which unit suffix) and by describe_plant.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Physical dimension of a parameter; the joint's kind turns it into a unit suffix.
enum class Dimension {
  kRatio,
  kPosition,
  kVelocity,
  kEffort,
  kStiffness,
  kDamping,
  kCompliance,
  kTime,
  kAngle,
  kOrder,     ///< periods of a pulley per joint turn, or rad per m of a prismatic joint
  kCoupling,  ///< this joint's unit per rad of another joint
};

enum class Sign {
  kSize,    ///< zero or more
  kEither,  ///< negative, too
};

struct ParameterSpec {
  std::string_view name;
  Dimension dimension;
  bool required;
  Sign sign = Sign::kSize;
};

struct EffectSpec {
  std::string_view id;
  std::string_view sentence;  ///< what it does, in plain words
  std::span<const ParameterSpec> parameters;
};

/// Effects that can be simulated.
std::span<const EffectSpec> effect_specs();
const EffectSpec* find_effect_spec(std::string_view id);

/// What is wrong with an effect that no plant may have: a parameter that it needs is missing, or it
/// names a source (`from`) that it has no use for. Empty if nothing is, or if the id is unknown.
std::string flaw_of(const Effect& effect);

/// "_rad" or "_m", "_n_m_per_rad" or "_n_per_m", ...; empty for ratios.
std::string_view unit_suffix(Dimension dimension, JointKind kind);

/// Key in the file: name with its unit suffix, e.g. "half_width_rad".
std::string key_of(const ParameterSpec& parameter, JointKind kind);

}  // namespace ravencal::physics
