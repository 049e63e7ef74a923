// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/effects_in_models.hpp"

#include <algorithm>
#include <array>

#include "physics/effects/effect_spec.hpp"

namespace ravencal::physics {
namespace {

constexpr std::string_view kActuator = "where the joint has an actuator";

constexpr std::array<EffectInModels, 22> kInModels = {{
    {"homing_offset", "", "", "", false, "a model knows no encoder's zero"},
    {"gain_error", "", "", "", false, "a model has one position of a joint, not drive and joint"},
    {"coupling", "", "equality polycoef", "", false, "where the model couples these joints"},
    {"compliance", "joint NAME_cable", "joint NAME_cable", "", false, "by its stiffness"},
    {"backlash", "joint NAME_backlash", "joint NAME_backlash", ""},
    {"joint_friction", "", "frictionloss", "dynamics friction", false,
     "where nothing yields before it"},
    {"hysteresis", "", "", "", false, "a spring of MJCF has no memory"},
    {"creep", "", "", "", false, "a spring of MJCF has no memory"},
    {"eccentricity", "", "", "", false, "a model has no cable"},
    {"coulomb_friction", "frictionloss", "frictionloss", "dynamics friction", false,
     "by its level"},
    {"viscous_friction", "damping", "damping", "dynamics damping"},
    {"stribeck_friction", "", "", "", true},
    {"presliding", "", "", "", true},
    {"asymmetric_friction", "", "", "", true},
    {"load_dependent_friction", "", "", "", true},
    {"torque_constant", "", "gear, gains", "", false, kActuator},
    {"torque_ripple", "", "", "", true},
    {"gravity", "", "", "", true},
    {"effort_offset", "bias", "bias", "", false, kActuator},
    {"delay", "", "", "", false, "the joint's encoder shows the past, the drive's does not"},
    {"saturation", "forcerange", "forcerange", "", false, kActuator},
    {"thermal_drift", "", "", "", false, "a model has no cable"},
}};

/// Of a parameter that shapes an effect and has no size itself.
bool is_form(const EffectSpec& spec, const ParameterSpec& p) {
  return &p != &spec.parameters.front() &&
         (p.dimension == Dimension::kTime || p.dimension == Dimension::kAngle ||
          p.dimension == Dimension::kOrder || p.dimension == Dimension::kVelocity);
}

}  // namespace

std::span<const EffectInModels> effects_in_models() { return kInModels; }

const EffectInModels& in_models(std::string_view effect) {
  return *std::find_if(kInModels.begin(), kInModels.end(),
                       [&](const EffectInModels& row) { return row.id == effect; });
}

bool acts(const Effect& effect) {
  const EffectSpec* spec = find_effect_spec(effect.id);
  return std::any_of(spec->parameters.begin(), spec->parameters.end(), [&](const ParameterSpec& p) {
    const auto at = effect.parameters.find(p.name);
    return !is_form(*spec, p) && at != effect.parameters.end() && at->second != 0.0;
  });
}

}  // namespace ravencal::physics
