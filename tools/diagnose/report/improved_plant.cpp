// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/report/write_report.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::diagnose {
namespace {

/// The effect's table in the joint, made if absent; the one with the same `from` for couplings.
toml::table& effect_table(toml::table& joint, const NamedEffect& effect) {
  if (!joint.contains("effect")) joint.insert("effect", toml::array{});
  toml::array& effects = *joint["effect"].as_array();
  for (toml::node& node : effects) {
    toml::table& table = *node.as_table();
    const bool same_source = table["from"].value_or(std::string()) == effect.from;
    if (table["id"].value_or(std::string()) == effect.id && same_source) return table;
  }
  toml::table made{{"id", effect.id}};
  if (!effect.from.empty()) made.insert("from", effect.from);
  effects.push_back(std::move(made));
  return *effects.back().as_table();
}

/// A nominal parameter at its refitted value; false if it has no place in the file.
bool set_nominal(toml::table& joint_table, const physics::Joint& joint, const NamedEffect& e) {
  const NamedParameter& p = e.parameters.front();
  if (p.name == "inertia" && joint.motor_inertia_kg_m2 > 0.0) {
    double link = joint.link.mass_kg;
    if (joint.kind == physics::JointKind::kRevolute) {
      link = joint.link.inertia_kg_m2[2] +
             joint.link.mass_kg * (joint.link.com_m[0] * joint.link.com_m[0] +
                                   joint.link.com_m[1] * joint.link.com_m[1]);
    }
    const double changed = (p.in_plant() - link) / (joint.reduction * joint.reduction);
    if (changed <= 0.0) return false;
    joint_table.insert_or_assign("motor_inertia_kg_m2", changed);
    return true;
  }
  if (e.id == "gravity" && p.name == "weight_scale" && joint.link.mass_kg > 0.0) {
    toml::table* link = joint_table["link"].as_table();
    if (link == nullptr) return false;
    link->insert_or_assign("mass_kg", joint.link.mass_kg * p.in_plant());
    return true;
  }
  const physics::EffectSpec* spec = physics::find_effect_spec(e.id);
  if (spec == nullptr) return false;
  for (const physics::ParameterSpec& parameter_spec : spec->parameters) {
    if (parameter_spec.name != p.name) continue;
    effect_table(joint_table, e)
        .insert_or_assign(physics::key_of(parameter_spec, joint.kind), p.in_plant());
    return true;
  }
  return false;
}

/// Effects that belong to the robot and not to one joint; false if `e` is none.
bool add_to_robot(toml::table& root, const physics::Plant& plant, const NamedEffect& e) {
  if (e.id == "payload") {
    toml::table table{{"mass_kg", plant.payload.mass_kg + plant_value(e, "mass")}};
    const auto& com = plant.payload.com_m;
    table.insert("com_m", toml::array{com[0], com[1], com[2]});
    root.insert_or_assign("payload", std::move(table));
    return true;
  }
  toml::table* logger = root["logger"].as_table();
  if (e.id == "delay" && e.stage == "sensor" && logger != nullptr) {
    const double whole =
        plant.logger.truth_latency_s + plant_value(e, "delay") +
        (e.out_of_tolerance ? plant_value(e, "truth_latency") - plant.logger.truth_latency_s -
                                  0.5 * plant.logger.truth_period_s
                            : 0.0);
    if (whole < 0.0) return false;
    logger->insert_or_assign("truth_latency_s", whole);
    return true;
  }
  return false;
}

/// Compliance to recorded loads: a table for each load and each posture on which it depends. Those
/// that the plant had are replaced.
bool add_load_compliance(toml::table& joint_table, const physics::Joint& joint,
                         const NamedEffect& e) {
  constexpr std::string_view kLoad = "compliance_to_", kPosture = "centre_of_";
  if (e.id != "compliance" || !e.parameters.front().name.starts_with(kLoad)) return false;
  if (!joint_table.contains("effect")) joint_table.insert("effect", toml::array{});
  toml::array& effects = *joint_table["effect"].as_array();
  for (std::size_t i = effects.size(); i-- > 0;) {
    const toml::table& table = *effects[i].as_table();
    if (table["id"].value_or(std::string()) == e.id && table.contains("from"))
      effects.erase(effects.begin() + static_cast<std::ptrdiff_t>(i));
  }
  const std::string unit(physics::unit_suffix(physics::Dimension::kPosition, joint.kind));
  for (const NamedParameter& p : e.parameters) {
    if (!p.name.starts_with(kLoad)) continue;
    const std::string load = p.name.substr(kLoad.size());
    toml::table plain{{"id", e.id}, {"from", load}};
    double at_zero = p.value;
    for (const NamedParameter& centre : e.parameters) {
      if (!centre.name.starts_with(kPosture)) continue;
      const std::string posture = centre.name.substr(kPosture.size());
      const double slope = plant_value(e, "slope_to_" + load + "_by_" + posture);
      at_zero -= slope * centre.value;
      toml::table table{{"id", e.id}, {"from", load}, {"posture", posture}};
      table.insert("stretch_per_load" + unit, 0.0);
      table.insert("stretch_per_load_and_posture" + unit, slope);
      effects.push_back(std::move(table));
    }
    plain.insert("stretch_per_load" + unit, at_zero);
    const double stiffening = plant_value(e, "stiffening_to_" + load);
    if (stiffening != 0.0) plain.insert("stiffening_per_load2" + unit, stiffening);
    effects.push_back(std::move(plain));
  }
  return true;
}

/// The law's gain, where all recordings agree on it.
bool set_controller_gain(toml::table& joint_table, const physics::Joint& joint,
                         const Report& report) {
  double least = 1e300, most = 0.0;
  for (const NamedEffect& e : report.effects) {
    if (e.id != "controller_gain" || e.joint != joint.name) continue;
    least = std::min(least, e.parameters.front().value);
    most = std::max(most, e.parameters.front().value);
  }
  toml::table* controller = joint_table["controller"].as_table();
  if (controller == nullptr || !joint.controller || !(least > 0.0) || most > 1.1 * least)
    return false;
  controller->insert_or_assign("kp_n_m_per_rad",
                               joint.controller->kp_n_m_per_rad * 0.5 * (least + most));
  return true;
}

bool add_effect(toml::table& joint_table, const physics::Joint& joint, const NamedEffect& e) {
  const physics::EffectSpec* spec = physics::find_effect_spec(e.id);
  const PlantValues values = effect_kind(e.id).plant_values(e, joint);
  if (spec == nullptr || values.empty()) return false;
  toml::table& table = effect_table(joint_table, e);
  for (const physics::ParameterSpec& parameter_spec : spec->parameters) {
    const auto value = values.find(std::string(parameter_spec.name));
    if (value != values.end())
      table.insert_or_assign(physics::key_of(parameter_spec, joint.kind), value->second);
  }
  return true;
}

/// The seat that the joint must find at its stop for the constant that the recording shows: ratio
/// and coupling are wrong about the stop, where counting begins, and the plant knows how far the
/// controller's stop is from the encoder's. `improved` has every other number already.
double seat_at_stop(const physics::Plant& improved, std::size_t index, double constant) {
  const physics::Joint& joint = improved.joints[index];
  const auto stop = [&](std::size_t k) {
    const auto& homing = improved.joints[k].homing;
    return homing ? homing->stop_controller_ji : 0.0;
  };
  double motor_part = stop(index);
  for (std::size_t k = 0; k < improved.joints.size() && index < improved.coupling.size(); ++k)
    motor_part -= improved.coupling[index][k] * stop(k);
  double seat = constant + joint.parameter("gain_error", "ratio") * motor_part;
  for (const physics::Effect& effect : joint.effects) {
    const auto source = improved.joint_index(effect.from);
    if (effect.id == "coupling" && source) seat += effect.parameters.at("error") * stop(*source);
  }
  return seat - (joint.homing->stop_encoder_ji - joint.homing->stop_controller_ji);
}

/// Constants of joints that home, moved to their stops.
void anchor_at_stops(toml::table& root, const physics::Plant& plant, const Report& report) {
  std::ostringstream text;
  text << root;
  const auto improved = physics::parse_plant(text.str(), plant.source);
  if (!improved.ok()) return;
  for (const NamedEffect& e : report.effects) {
    const auto index = plant.joint_index(e.joint);
    if (e.id != "homing_offset" || !index || !plant.joints[*index].homing) continue;
    toml::table& joint_table = *(*root["joint"].as_array())[*index].as_table();
    const auto kind = plant.joints[*index].kind;
    for (const physics::ParameterSpec& spec : physics::find_effect_spec(e.id)->parameters) {
      if (spec.name == "offset")
        effect_table(joint_table, e)
            .insert_or_assign(physics::key_of(spec, kind),
                              seat_at_stop(*improved, *index, plant_value(e, "offset")));
    }
  }
}

std::string comment_for(const NamedEffect& e) {
  std::string text = fmt::format("#   {} ({}): {}", e.joint, e.stage, e.id);
  for (const NamedParameter& p : e.parameters) {
    if (!p.name.starts_with("begin_"))
      text += fmt::format(", {} = {:.6g} {}", p.name, p.value, p.unit);
  }
  return text + "\n";
}

}  // namespace

core::Result<std::string> improved_plant(const physics::Plant& plant, const Report& report) {
  toml::table root;
  try {
    root = toml::parse_file(plant.source);
  } catch (const toml::parse_error& error) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: {}", plant.source, error.description())};
  }
  // First the numbers that only moved within their tolerance, then what has no name; names
  // overwrite both.
  for (const NamedEffect& e : report.refitted) {
    const auto index = plant.joint_index(e.joint);
    if (!index || e.id == "delay") continue;
    // A robot that homes finds its own offset each time.
    const physics::Joint& joint = plant.joints[*index];
    if (e.id == "homing_offset" && (joint.homing || joint.find_effect(e.id) != nullptr)) continue;
    set_nominal(*(*root["joint"].as_array())[*index].as_table(), joint, e);
  }
  std::string comments;
  std::vector<NamedEffect> found = report.kept;
  found.insert(found.end(), report.effects.begin(), report.effects.end());
  for (const NamedEffect& e : found) {
    const auto index = plant.joint_index(e.joint);
    if (!index || e.id == "unknown" || e.parameters.empty()) continue;
    toml::table& joint_table = *(*root["joint"].as_array())[*index].as_table();
    const physics::Joint& joint = plant.joints[*index];
    if (add_to_robot(root, plant, e)) continue;
    const bool written =
        e.out_of_tolerance ? set_nominal(joint_table, joint, e)
        : e.id == "controller_gain"
            ? set_controller_gain(joint_table, joint, report)
            : add_load_compliance(joint_table, joint, e) || add_effect(joint_table, joint, e);
    if (!written) comments += comment_for(e);
  }
  anchor_at_stops(root, plant, report);
  std::ostringstream text;
  text << "# " << plant.robot.name << ", improved by `ravencal diagnose`.\n";
  text << root << "\n";
  if (!comments.empty())
    text << "\n# Found, but beyond what `ravencal simulate` can run:\n" << comments;
  return text.str();
}

}  // namespace ravencal::diagnose
