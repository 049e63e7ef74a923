// SPDX-License-Identifier: Apache-2.0
#include "physics/effects/effect_spec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "physics/plant_ranges.hpp"

namespace ravencal::physics {
namespace {

constexpr ParameterSpec kGainError[] = {{"ratio", Dimension::kRatio, true, Sign::kEither}};
constexpr ParameterSpec kCouplingError[] = {{"error", Dimension::kCoupling, true, Sign::kEither}};
constexpr ParameterSpec kCompliance[] = {
    {"stiffness", Dimension::kStiffness, false},
    {"damping", Dimension::kDamping, false},
    {"stretch_per_load", Dimension::kPosition, false, Sign::kEither},
    {"stretch_per_load_and_posture", Dimension::kPosition, false, Sign::kEither},
    {"stiffening_per_load2", Dimension::kPosition, false, Sign::kEither}};
constexpr ParameterSpec kBacklash[] = {{"half_width", Dimension::kPosition, true}};
constexpr ParameterSpec kJointFriction[] = {{"level", Dimension::kEffort, false},
                                            {"presliding", Dimension::kPosition, false},
                                            {"stretch", Dimension::kPosition, false, Sign::kEither},
                                            {"width", Dimension::kPosition, false},
                                            {"damping", Dimension::kDamping, false},
                                            {"load_share", Dimension::kRatio, false, Sign::kEither},
                                            {"variation", Dimension::kRatio, false},
                                            {"variation_time", Dimension::kTime, false}};
constexpr ParameterSpec kHysteresis[] = {
    {"stiffness", Dimension::kStiffness, false},
    {"yield", Dimension::kPosition, false},
    {"half_loop", Dimension::kPosition, false, Sign::kEither},
    {"half_loop_narrow", Dimension::kPosition, false, Sign::kEither},
    {"half_loop_wide", Dimension::kPosition, false, Sign::kEither},
    {"width", Dimension::kPosition, false}};
constexpr ParameterSpec kDelay[] = {{"delay", Dimension::kTime, true}};
constexpr ParameterSpec kCreep[] = {{"compliance", Dimension::kCompliance, true},
                                    {"time", Dimension::kTime, true}};
constexpr ParameterSpec kEccentricity[] = {{"amplitude", Dimension::kPosition, true, Sign::kEither},
                                           {"order", Dimension::kOrder, true, Sign::kEither},
                                           {"phase", Dimension::kAngle, false, Sign::kEither}};
constexpr ParameterSpec kHomingOffset[] = {{"deviation", Dimension::kPosition, false},
                                           {"offset", Dimension::kPosition, false, Sign::kEither}};
constexpr ParameterSpec kCoulomb[] = {{"level", Dimension::kEffort, false},
                                      {"lag", Dimension::kPosition, false, Sign::kEither},
                                      {"width", Dimension::kPosition, false},
                                      {"variation", Dimension::kRatio, false},
                                      {"variation_time", Dimension::kTime, false}};
constexpr ParameterSpec kViscous[] = {{"damping", Dimension::kDamping, true}};
constexpr ParameterSpec kStribeck[] = {{"extra", Dimension::kEffort, true, Sign::kEither},
                                       {"velocity", Dimension::kVelocity, true}};
constexpr ParameterSpec kPresliding[] = {{"displacement", Dimension::kPosition, true},
                                         {"damping", Dimension::kDamping, false}};
constexpr ParameterSpec kAsymmetric[] = {
    {"damping_difference", Dimension::kDamping, false, Sign::kEither},
    {"level_difference", Dimension::kEffort, false, Sign::kEither}};
constexpr ParameterSpec kLoadFriction[] = {{"load_share", Dimension::kRatio, true, Sign::kEither}};
constexpr ParameterSpec kTorqueRipple[] = {{"amplitude", Dimension::kEffort, true, Sign::kEither},
                                           {"order", Dimension::kOrder, true, Sign::kEither},
                                           {"phase", Dimension::kAngle, false, Sign::kEither}};
constexpr ParameterSpec kGravity[] = {{"amplitude", Dimension::kEffort, true, Sign::kEither},
                                      {"phase", Dimension::kAngle, false, Sign::kEither}};
constexpr ParameterSpec kEffortOffset[] = {{"offset", Dimension::kEffort, true, Sign::kEither}};
constexpr ParameterSpec kSaturation[] = {{"limit", Dimension::kEffort, true}};
constexpr ParameterSpec kTorqueConstant[] = {{"ratio", Dimension::kRatio, true, Sign::kEither}};
constexpr ParameterSpec kThermalDrift[] = {{"final", Dimension::kPosition, false, Sign::kEither},
                                           {"time", Dimension::kTime, false},
                                           {"wander", Dimension::kPosition, false},
                                           {"wander_time", Dimension::kTime, false}};

constexpr std::array<EffectSpec, 22> kSpecs = {{
    {"homing_offset", "the seat at the hard stop differs at each homing", kHomingOffset},
    {"gain_error", "the transmission ratio is not the one that the controller knows", kGainError},
    {"coupling", "another joint moves this one more than the controller knows", kCouplingError},
    {"compliance", "the cable stretches under load", kCompliance},
    {"backlash", "a gap without torque between drive and joint", kBacklash},
    {"joint_friction", "friction behind the cable, which holds part of its stretch",
     kJointFriction},
    {"hysteresis", "the cable's strands rub: stretch depends on the load's history", kHysteresis},
    {"creep", "the cable yields slowly under load and recovers slowly", kCreep},
    {"eccentricity", "a pulley runs out of true", kEccentricity},
    {"coulomb_friction", "dry friction of motor and gearbox", kCoulomb},
    {"viscous_friction", "friction that grows with speed", kViscous},
    {"stribeck_friction", "friction is higher at rest than in motion", kStribeck},
    {"presliding", "friction yields elastically before it slips", kPresliding},
    {"asymmetric_friction", "friction differs between the two directions", kAsymmetric},
    {"load_dependent_friction", "friction grows with the effort that passes through",
     kLoadFriction},
    {"torque_constant", "the motor gives more or less torque than commanded", kTorqueConstant},
    {"torque_ripple", "the drive's effort waves over its position", kTorqueRipple},
    {"gravity", "the links weigh more or less than the plant's", kGravity},
    {"effort_offset", "a constant effort acts on the drive", kEffortOffset},
    {"delay", "the joint follows late", kDelay},
    {"saturation", "the drive gives no more than its limit", kSaturation},
    {"thermal_drift", "cable length wanders slowly, without load", kThermalDrift},
}};

/// Effects with two ways of being described: by what happens at the cable, or by the loop or
/// stretch that positions alone show. One of the two must be whole.
struct Alternatives {
  std::string_view id;
  std::array<std::string_view, 2> by_effort, by_position;  ///< the second may be empty
};
constexpr std::array<Alternatives, 4> kAlternatives = {{
    {"compliance", {"stiffness", "damping"}, {"stretch_per_load", ""}},
    {"coulomb_friction", {"level", ""}, {"lag", "width"}},
    {"joint_friction", {"level", "presliding"}, {"stretch", "width"}},
    {"hysteresis", {"stiffness", "yield"}, {"half_loop", "width"}},
}};

constexpr std::array<std::string_view, 3> kWithSource = {"coupling", "hysteresis", "compliance"};

bool has(const Effect& effect, std::string_view parameter) {
  return effect.parameters.find(parameter) != effect.parameters.end();
}

/// Empty if one of the effect's two descriptions is whole, or if it has one only.
std::string flaw_of_description(const Effect& effect) {
  for (const Alternatives& a : kAlternatives) {
    if (a.id != effect.id) continue;
    const auto whole = [&](const std::array<std::string_view, 2>& names) {
      return std::all_of(names.begin(), names.end(),
                         [&](std::string_view name) { return name.empty() || has(effect, name); });
    };
    const auto words = [](std::string_view one, std::string_view other) {
      return other.empty() ? std::string(one) : fmt::format("{} and {}", one, other);
    };
    const bool named_load = effect.id != "compliance" || effect.from.empty() == whole(a.by_effort);
    if (named_load && (whole(a.by_position) || (whole(a.by_effort) && effect.from.empty())))
      return {};
    return fmt::format(
        "effect '{}' needs {}, or {}", effect.id, words(a.by_effort[0], a.by_effort[1]),
        words(a.by_position[0], effect.id == "compliance" ? "from" : a.by_position[1]));
  }
  return {};
}

}  // namespace

std::span<const EffectSpec> effect_specs() { return kSpecs; }

const EffectSpec* find_effect_spec(std::string_view id) {
  const auto it = std::find_if(kSpecs.begin(), kSpecs.end(),
                               [&](const EffectSpec& spec) { return spec.id == id; });
  return it == kSpecs.end() ? nullptr : &*it;
}

std::string flaw_of(const Effect& effect) {
  const EffectSpec* spec = find_effect_spec(effect.id);
  if (spec == nullptr) return {};
  for (const ParameterSpec& parameter : spec->parameters) {
    if (parameter.required && !has(effect, parameter.name))
      return fmt::format("effect '{}' needs {}", effect.id, parameter.name);
  }
  if (!effect.from.empty() &&
      std::find(kWithSource.begin(), kWithSource.end(), effect.id) == kWithSource.end())
    return fmt::format("effect '{}' takes no from", effect.id);
  return flaw_of_description(effect);
}

core::NumberRange range_of(const ParameterSpec& parameter) {
  const auto largest = [&] {
    switch (parameter.dimension) {
      case Dimension::kRatio:
      case Dimension::kCoupling:
        return kCouplingRange.high;
      case Dimension::kPosition:
      case Dimension::kAngle:
        return kPositionRange.high;
      case Dimension::kVelocity:
        return kVelocityRange.high;
      case Dimension::kEffort:
        return 1e9;
      case Dimension::kStiffness:
        return kStiffnessRange.high;
      case Dimension::kDamping:
        return kDampingRange.high;
      case Dimension::kCompliance:
        return 1e3;
      case Dimension::kTime:
        return 1e9;
      case Dimension::kOrder:
        return kTransmissionRange.high;
    }
    return 0.0;
  }();
  return {parameter.sign == Sign::kSize ? 0.0 : -largest, largest};
}

std::string_view unit_suffix(Dimension dimension, JointKind kind) {
  const bool revolute = kind == JointKind::kRevolute;
  switch (dimension) {
    case Dimension::kRatio:
      return "";
    case Dimension::kCoupling:
      return revolute ? "_rad_per_rad" : "_m_per_rad";
    case Dimension::kPosition:
      return revolute ? "_rad" : "_m";
    case Dimension::kVelocity:
      return revolute ? "_rad_per_s" : "_m_per_s";
    case Dimension::kEffort:
      return revolute ? "_n_m" : "_n";
    case Dimension::kStiffness:
      return revolute ? "_n_m_per_rad" : "_n_per_m";
    case Dimension::kDamping:
      return revolute ? "_n_m_s_per_rad" : "_n_s_per_m";
    case Dimension::kCompliance:
      return revolute ? "_rad_per_n_m" : "_m_per_n";
    case Dimension::kTime:
      return "_s";
    case Dimension::kAngle:
      return "_rad";
    case Dimension::kOrder:
      return revolute ? "" : "_rad_per_m";
  }
  return "";
}

std::string key_of(const ParameterSpec& parameter, JointKind kind) {
  return std::string(parameter.name) + std::string(unit_suffix(parameter.dimension, kind));
}

}  // namespace ravencal::physics
