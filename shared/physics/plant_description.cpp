// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/joint_layout.hpp"
#include "physics/effects/effect_spec.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {
namespace {

/// Other robots have no gold and no green arm.
bool is_raven_arm(const Plant& plant) {
  return std::all_of(plant.joints.begin(), plant.joints.end(), [](const Joint& joint) {
    const auto& names = core::kSlotNames;
    return std::find(names.begin(), names.end(), joint.name) != names.end();
  });
}

std::string describe_effect(const Effect& effect, JointKind kind) {
  const EffectSpec* spec = find_effect_spec(effect.id);
  if (spec == nullptr) return fmt::format("    {}\n", effect.id);
  std::string text = fmt::format("    {:<18}{}", effect.id, spec->sentence);
  if (!effect.from.empty()) text += fmt::format("; from {}", effect.from);
  for (const ParameterSpec& parameter : spec->parameters) {
    const auto it = effect.parameters.find(parameter.name);
    if (it == effect.parameters.end()) continue;
    text += fmt::format("; {} {:.4g}", key_of(parameter, kind), it->second);
  }
  return text + "\n";
}

nlohmann::json limits_in_json(const Limits& limits) {
  nlohmann::json out = nlohmann::json::object();
  if (limits.low_ji) out["low"] = *limits.low_ji;
  if (limits.high_ji) out["high"] = *limits.high_ji;
  if (limits.speed_ji) out["speed"] = *limits.speed_ji;
  return out;
}

std::string describe_limits(const Joint& joint) {
  const Limits& limits = joint.limits;
  if (limits == Limits{}) return {};
  const char* unit = joint.kind == JointKind::kRevolute ? "rad" : "m";
  std::string text = "    moves";
  if (limits.low_ji) text += fmt::format(" from {:.4g} {}", *limits.low_ji, unit);
  if (limits.high_ji) text += fmt::format(" to {:.4g} {}", *limits.high_ji, unit);
  if (limits.speed_ji) text += fmt::format(" at up to {:.4g} {}/s", *limits.speed_ji, unit);
  return text + "\n";
}

}  // namespace

std::string describe_plant(const Plant& plant) {
  std::string text = fmt::format(
      "plant {}{}, {} joints, integrated at {:.0f} Hz inside {:.0f} Hz\n", plant.robot.name,
      is_raven_arm(plant) ? fmt::format(" ({} arm)", plant.robot.arm) : "", plant.joints.size(),
      plant.robot.inner_rate_hz, plant.robot.control_rate_hz);
  if (!plant.robot.controller.name.empty())
    text += fmt::format("controller {}\n", plant.robot.controller.name);
  text +=
      fmt::format("payload {:.3g} kg; motor encoders {:.0f} counts/rev; hash {:016x}\n",
                  plant.payload.mass_kg, plant.sensors.motor_encoder_counts_per_rev, plant.hash);
  for (const Joint& joint : plant.joints) {
    const bool revolute = joint.kind == JointKind::kRevolute;
    text +=
        fmt::format("  {}: {}, reduction {:.6g} {}, motor inertia {:.3g} kg m2, link {:.3g} kg\n",
                    joint.name, revolute ? "revolute" : "prismatic", joint.reduction,
                    revolute ? "rad/rad" : "rad/m", joint.motor_inertia_kg_m2, joint.link.mass_kg);
    text += describe_limits(joint);
    if (joint.coupling_through)
      text += fmt::format("    its cable follows the other joints' {}s\n",
                          through_word(*joint.coupling_through));
    if (joint.external_load)
      text += fmt::format("    loaded from outside by {:.4g} times the recorded '{}'\n",
                          joint.external_load->ratio, joint.external_load->channel);
    if (joint.controller) {
      text += fmt::format(
          "    PD {:.4g} N m/rad, {:.4g} N m s/rad at the motor, clipped at {:.0f} DAC counts\n",
          joint.controller->kp_n_m_per_rad, joint.controller->kd_n_m_s_per_rad,
          joint.controller->dac_limit_counts);
    }
    for (const Effect& effect : joint.effects) text += describe_effect(effect, joint.kind);
  }
  return text;
}

std::string describe_plant_in_json(const Plant& plant) {
  nlohmann::json joints = nlohmann::json::array();
  for (const Joint& joint : plant.joints) {
    nlohmann::json effects = nlohmann::json::array();
    for (const Effect& effect : joint.effects) {
      nlohmann::json entry = {{"id", effect.id}};
      if (!effect.from.empty()) entry["from"] = effect.from;
      for (const ParameterSpec& parameter : find_effect_spec(effect.id)->parameters) {
        const auto it = effect.parameters.find(parameter.name);
        if (it != effect.parameters.end()) entry[key_of(parameter, joint.kind)] = it->second;
      }
      effects.push_back(std::move(entry));
    }
    joints.push_back({{"name", joint.name},
                      {"kind", joint.kind == JointKind::kRevolute ? "revolute" : "prismatic"},
                      {"reduction", joint.reduction},
                      {"motor_inertia_kg_m2", joint.motor_inertia_kg_m2},
                      {"link_mass_kg", joint.link.mass_kg},
                      {"effects", std::move(effects)}});
    if (joint.limits != Limits{}) joints.back()["limits"] = limits_in_json(joint.limits);
    if (joint.coupling_through)
      joints.back()["coupling_through"] = through_word(*joint.coupling_through);
    if (joint.external_load)
      joints.back()["external_load"] = {{"channel", joint.external_load->channel},
                                        {"ratio", joint.external_load->ratio}};
  }
  const nlohmann::json document = {{"plant", plant.robot.name},
                                   {"arm", is_raven_arm(plant) ? plant.robot.arm : ""},
                                   {"controller", plant.robot.controller.name},
                                   {"payload_kg", plant.payload.mass_kg},
                                   {"inner_rate_hz", plant.robot.inner_rate_hz},
                                   {"hash", fmt::format("{:016x}", plant.hash)},
                                   {"joints", std::move(joints)}};
  return document.dump();
}

}  // namespace ravencal::physics
