// SPDX-License-Identifier: Apache-2.0
//
// Any plant reads back from its text as it was, to the last bit of each number.
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "physics/effects/effect_spec.hpp"
#include "physics/plant.hpp"
#include "physics/plant_ranges.hpp"
#include "physics/plant_writer.hpp"
#include "physics/tolerance_keys.hpp"

namespace {

using namespace ravencal::physics;

/// Any double of a range, the smallest and those that look like integers among them.
double number(ravencal::core::NumberRange range) {
  if (*rc::gen::inRange(0, 3) == 0)
    return std::clamp<double>(*rc::gen::inRange(-2000, 2000), range.low, range.high);
  const auto bits = *rc::gen::arbitrary<std::uint64_t>();
  const auto drawn = std::bit_cast<double>(bits);
  if (drawn >= range.low && drawn <= range.high) return drawn;
  const double share = std::ldexp(static_cast<double>(bits), -64);
  return std::clamp(range.low * (1.0 - share) + range.high * share, range.low, range.high);
}

template <std::size_t N>
void draw(std::array<double, N>& values, ravencal::core::NumberRange range) {
  for (double& value : values) value = number(range);
}

/// Of all signs of ASCII, so that nothing is left to chance in quoting.
std::string words() {
  std::string text;
  const int length = *rc::gen::inRange(0, 12);
  for (int i = 0; i < length; ++i) text += static_cast<char>(*rc::gen::inRange(1, 128));
  return text;
}

bool chance() { return *rc::gen::arbitrary<bool>(); }

Effect draw_effect(const EffectSpec& spec, std::size_t joint) {
  Effect effect{std::string(spec.id), "", {}};
  const std::string other = "j" + std::to_string((joint + 1) % 2);
  if (spec.id == "coupling" || (spec.id == "hysteresis" && chance())) effect.from = other;
  if (spec.id == "compliance" && chance()) {
    effect.from = "load " + words();
    if (chance()) effect.posture = other;
  }
  for (const ParameterSpec& parameter : spec.parameters) {
    if (parameter.required || chance())
      effect.parameters.emplace(std::string(parameter.name), number(range_of(parameter)));
  }
  return effect;
}

Joint draw_joint(std::size_t index) {
  Joint joint;
  joint.name = "j" + std::to_string(index);
  joint.kind = chance() ? JointKind::kRevolute : JointKind::kPrismatic;
  joint.motor_inertia_kg_m2 = number(kRotorRange);
  joint.gearbox_ratio = number(kTransmissionRange);
  joint.reduction = number(kTransmissionRange);
  joint.encoder_sign = number(kSignRange);
  joint.joint_encoder_resolution_ji = number(kResolutionRange);
  if (chance()) {
    joint.link.mass_kg = number(kMassRange);
    draw(joint.link.com_m, kLengthRange);
    draw(joint.link.inertia_kg_m2, kInertiaRange);
  }
  if (chance())
    joint.drive = {*rc::gen::element<std::string>("torque_n_m", "force_n", "voltage_v"),
                   number(kGainRange), number(kGainRange)};
  if (chance()) {
    joint.controller = {number(kStiffnessRange), number(kDampingRange), number(kCountsRange),
                        chance()};
  }
  if (chance()) {
    joint.homing = {number(kVelocityRange), number(kCountsRange),    number(kPositionRange),
                    number(kPositionRange), number(kStiffnessRange), number(kDampingRange),
                    number(kPositionRange)};
  }
  for (const EffectSpec& spec : effect_specs()) {
    if (!chance()) continue;
    Effect effect = draw_effect(spec, index);
    if (flaw_of(effect).empty()) joint.effects.push_back(std::move(effect));
  }
  const std::vector<std::string> keys = tolerance_keys();
  if (chance()) joint.tolerance.emplace(*rc::gen::elementOf(keys), number(kToleranceRange));
  return joint;
}

RC_GTEST_PROP(PlantTextProperty, ReadsBackAsItWas, ()) {
  Plant plant;
  plant.robot.name = words();
  plant.robot.arm = words();
  if (chance()) plant.robot.controller = *find_controller_branch(chance() ? "main" : "crtk");
  plant.robot.control_rate_hz = *rc::gen::inRange(1, 2000);
  plant.robot.inner_rate_hz = plant.robot.control_rate_hz * *rc::gen::inRange(1, 20);
  draw(plant.robot.gravity_m_per_s2, kGravityRange);
  draw(plant.robot.tool_joints_rad, kPositionRange);
  if (chance()) {
    plant.payload.mass_kg = number(kMassRange);
    draw(plant.payload.com_m, kLengthRange);
  }
  if (chance()) plant.sensors.motor_encoder_counts_per_rev = number(kCountsPerRevRange);
  if (chance()) {
    plant.logger = {number(kRowRateRange), number(kPeriodRange), number(kLatencyRange),
                    number(kLatencyRange), true};
  }
  for (std::size_t i = 0; i < 2; ++i) plant.joints.push_back(draw_joint(i));
  plant.coupling = {{0.0, 0.0}, {chance() ? number(kCouplingRange) : 0.0, 0.0}};
  const std::string text = plant_text(plant);
  auto again = parse_plant(text, plant.source);
  if (!again.ok()) RC_FAIL(again.error().message + "\n" + text);
  again->hash = plant.hash;
  RC_ASSERT(again.value() == plant);
  // Equal numbers may differ in the sign of zero; their texts do not.
  RC_ASSERT(plant_text(again.value()) == text);
}

}  // namespace
