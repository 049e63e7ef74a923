// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/improved_plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "physics/effects/effect_spec.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::diagnose {
namespace {

double parameter(const NamedEffect& effect, std::string_view name) {
  const NamedParameter* found = find_parameter(effect, name);
  return found != nullptr ? found->in_plant() : 0.0;
}

bool has(const NamedEffect& effect, std::string_view name) {
  return find_parameter(effect, name) != nullptr;
}

using PlantValues = std::map<std::string, double, std::less<>>;

/// Loops that positions alone show, for joints without a cable in the plant.
PlantValues loop_values(const NamedEffect& e) {
  const std::string suffix = e.from.empty() ? "" : "_from_" + e.from;
  PlantValues values;
  for (const char* name : {"half_loop", "half_loop_narrow", "half_loop_wide", "width", "stretch"}) {
    if (has(e, name + suffix)) values[name] = parameter(e, name + suffix);
  }
  return values;
}

/// Effects whose parameters a report and a plant call the same.
struct SameNames {
  std::string_view id;
  std::array<std::string_view, 3> parameters;  ///< the last ones may be empty
};
constexpr std::array<SameNames, 13> kSameNames = {{
    {"gain_error", {"ratio"}},
    {"torque_constant", {"ratio"}},
    {"backlash", {"half_width"}},
    {"viscous_friction", {"damping"}},
    {"stribeck_friction", {"extra", "velocity"}},
    {"presliding", {"displacement"}},
    {"creep", {"compliance", "time"}},
    {"thermal_drift", {"final", "time"}},
    {"eccentricity", {"amplitude", "order", "phase"}},
    {"asymmetric_friction", {"damping_difference", "level_difference"}},
    {"load_dependent_friction", {"load_share"}},
    {"saturation", {"limit"}},
    {"torque_ripple", {"amplitude", "order", "phase"}},
}};

/// Values of friction behind the cable.
PlantValues joint_friction_values(const NamedEffect& e, const physics::Joint& joint) {
  const double stiffness = joint.parameter("compliance", "stiffness");
  if (parameter(e, "level") > 0.0) {
    // How friction yields before it slips was not asked: a tenth of the cable's wind-up.
    return {
        {"level", parameter(e, "level") + joint.parameter("joint_friction", "level")},
        {"presliding", std::max(joint.parameter("joint_friction", "presliding"),
                                stiffness > 0.0 ? 0.1 * parameter(e, "level") / stiffness : 1e-4)}};
  }
  if (stiffness <= 0.0) return {};
  const double stretch = parameter(e, "stretch");
  return {{"level", stretch * stiffness},
          {"presliding", std::max(1e-6, 0.5 * parameter(e, "width") - stretch)}};
}

/// Values of what joins drive and joint: a cable, or the loops and the delay that positions show
/// where the plant has none.
PlantValues transmission_values(const NamedEffect& e, const physics::Joint& joint) {
  const double stiffness = joint.parameter("compliance", "stiffness");
  if (e.id == "compliance" && parameter(e, "compliance") > 0.0) {
    const double whole = parameter(e, "compliance") + (stiffness > 0.0 ? 1.0 / stiffness : 0.0);
    // The recording says nothing about damping; a hundredth of the stiffness per second is stable.
    return {{"stiffness", 1.0 / whole},
            {"damping", std::max(joint.parameter("compliance", "damping"), 0.01 / whole)}};
  }
  const bool cable = joint.find_effect("compliance") != nullptr;
  if (!cable && (has(e, "stretch") || e.parameters.front().name.starts_with("half_loop")))
    return loop_values(e);
  if (e.id == "delay" && !cable && parameter(e, "delay") > 0.0)
    return {{"delay", parameter(e, "delay")}};
  if (e.id == "hysteresis" && parameter(e, "stiffness") > 0.0)
    return {{"stiffness", parameter(e, "stiffness")}, {"yield", parameter(e, "yield")}};
  if (e.id == "joint_friction") return joint_friction_values(e, joint);
  return {};
}

/// Values of the plant's effect, by parameter name without unit; empty if `simulate` has no such
/// effect or the report does not fix all that it needs.
PlantValues plant_values(const NamedEffect& e, const physics::Joint& joint) {
  for (const SameNames& same : kSameNames) {
    if (same.id != e.id) continue;
    PlantValues values;
    for (const std::string_view name : same.parameters)
      if (!name.empty()) values.emplace(name, parameter(e, name));
    return values;
  }
  if (e.id == "coupling") return {{"error", parameter(e, "error_from_" + e.from)}};
  if (e.id == "coulomb_friction" && has(e, "level")) return {{"level", parameter(e, "level")}};
  if (e.id == "coulomb_friction")
    return {{"lag", parameter(e, "lag")}, {"width", 2.0 * parameter(e, "displacement")}};
  if (e.id == "homing_offset") {
    return {{"offset", parameter(e, "offset")},
            {"deviation", joint.parameter("homing_offset", "deviation")}};
  }
  return transmission_values(e, joint);
}

/// Values of the joint's effect of that id and source, which is made if absent. False, and
/// nothing is changed, if the vocabulary has none of them or no plant may have what would come out.
bool set_values(physics::Joint& joint, const NamedEffect& e, const PlantValues& values) {
  const physics::EffectSpec* spec = physics::find_effect_spec(e.id);
  if (spec == nullptr) return false;
  const auto there = std::find_if(
      joint.effects.begin(), joint.effects.end(),
      [&](const physics::Effect& effect) { return effect.id == e.id && effect.from == e.from; });
  physics::Effect changed =
      there != joint.effects.end() ? *there : physics::Effect{e.id, e.from, {}};
  bool any = false;
  for (const physics::ParameterSpec& parameter_spec : spec->parameters) {
    const auto value = values.find(parameter_spec.name);
    if (value == values.end()) continue;
    changed.parameters.insert_or_assign(value->first, value->second);
    any = true;
  }
  if (!any || !physics::flaw_of(changed).empty()) return false;
  if (there != joint.effects.end()) {
    *there = std::move(changed);
  } else {
    joint.effects.push_back(std::move(changed));
  }
  return true;
}

/// A nominal parameter at its refitted value; false if a plant has no place for it. `joint` is the
/// plant's, `improved` becomes it.
bool set_nominal(physics::Joint& improved, const physics::Joint& joint, const NamedEffect& e) {
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
    improved.motor_inertia_kg_m2 = changed;
    return true;
  }
  if (e.id == "gravity" && p.name == "weight_scale" && joint.link.mass_kg > 0.0) {
    if (p.in_plant() < 0.0) return false;
    improved.link.mass_kg = joint.link.mass_kg * p.in_plant();
    return true;
  }
  return set_values(improved, e, {{p.name, p.in_plant()}});
}

/// Effects that belong to the robot and not to one joint; false if `e` is none.
bool add_to_robot(physics::Plant& improved, const physics::Plant& plant, const NamedEffect& e) {
  if (e.id == "payload") {
    const double mass_kg = plant.payload.mass_kg + parameter(e, "mass");
    if (mass_kg < 0.0) return false;
    improved.payload.mass_kg = mass_kg;
    return true;
  }
  if (e.id == "delay" && e.stage == "sensor" && plant.logger.given) {
    const double whole =
        plant.logger.truth_latency_s + parameter(e, "delay") +
        (e.out_of_tolerance ? parameter(e, "truth_latency") - plant.logger.truth_latency_s -
                                  0.5 * plant.logger.truth_period_s
                            : 0.0);
    if (whole < 0.0) return false;
    improved.logger.truth_latency_s = whole;
    return true;
  }
  return false;
}

/// Compliance to recorded loads: an effect for each load and each posture on which it depends.
/// Those that the plant had are replaced.
bool add_load_compliance(physics::Joint& improved, const NamedEffect& e) {
  constexpr std::string_view kLoad = "compliance_to_", kPosture = "centre_of_";
  if (e.id != "compliance" || !e.parameters.front().name.starts_with(kLoad)) return false;
  std::erase_if(improved.effects, [&](const physics::Effect& effect) {
    return effect.id == e.id && !effect.from.empty();
  });
  for (const NamedParameter& p : e.parameters) {
    if (!p.name.starts_with(kLoad)) continue;
    const std::string load = p.name.substr(kLoad.size());
    physics::Effect plain{e.id, load, {}};
    double at_zero = p.value;
    for (const NamedParameter& centre : e.parameters) {
      if (!centre.name.starts_with(kPosture)) continue;
      const std::string posture = centre.name.substr(kPosture.size());
      const double slope = parameter(e, fmt::format("slope_to_{}_by_{}", load, posture));
      at_zero -= slope * centre.value;
      improved.effects.push_back(
          {e.id,
           load,
           {{"stretch_per_load", 0.0}, {"stretch_per_load_and_posture", slope}},
           posture});
    }
    plain.parameters.emplace("stretch_per_load", at_zero);
    const double stiffening = parameter(e, "stiffening_to_" + load);
    if (stiffening != 0.0) plain.parameters.emplace("stiffening_per_load2", stiffening);
    improved.effects.push_back(std::move(plain));
  }
  return true;
}

/// The law's gain, where all recordings agree on it.
bool set_controller_gain(physics::Joint& improved, const physics::Joint& joint,
                         const Report& report) {
  double least = 1e300, most = 0.0;
  for (const NamedEffect& e : report.effects) {
    if (e.id != "controller_gain" || e.joint != joint.name) continue;
    least = std::min(least, e.parameters.front().value);
    most = std::max(most, e.parameters.front().value);
  }
  if (!joint.controller || !(least > 0.0) || most > 1.1 * least) return false;
  improved.controller->kp_n_m_per_rad = joint.controller->kp_n_m_per_rad * 0.5 * (least + most);
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
void anchor_at_stops(physics::Plant& improved, const Report& report) {
  for (const NamedEffect& e : report.effects) {
    const auto index = improved.joint_index(e.joint);
    if (e.id != "homing_offset" || !index || !improved.joints[*index].homing) continue;
    set_values(improved.joints[*index], e,
               {{"offset", seat_at_stop(improved, *index, parameter(e, "offset"))}});
  }
}

/// The plant and what it has no words for.
struct Improved {
  physics::Plant plant;
  std::vector<NamedEffect> beyond;
};

Improved improve(const physics::Plant& plant, const Report& report) {
  Improved out{plant, {}};
  out.plant.hash = 0;
  // First the numbers that only moved within their tolerance, then what has no name; names
  // overwrite both.
  for (const NamedEffect& e : report.refitted) {
    const auto index = plant.joint_index(e.joint);
    if (!index || e.id == "delay") continue;
    // A robot that homes finds its own offset each time.
    const physics::Joint& joint = plant.joints[*index];
    if (e.id == "homing_offset" && (joint.homing || joint.find_effect(e.id) != nullptr)) continue;
    set_nominal(out.plant.joints[*index], joint, e);
  }
  std::vector<NamedEffect> found = report.kept;
  found.insert(found.end(), report.effects.begin(), report.effects.end());
  for (NamedEffect& e : found) {
    const auto index = plant.joint_index(e.joint);
    if (!index || e.id == "unknown" || e.parameters.empty()) continue;
    const physics::Joint& joint = plant.joints[*index];
    physics::Joint& improved = out.plant.joints[*index];
    const bool written =
        add_to_robot(out.plant, plant, e) ||
        (e.out_of_tolerance ? set_nominal(improved, joint, e)
         : e.id == "controller_gain"
             ? set_controller_gain(improved, joint, report)
             : add_load_compliance(improved, e) || set_values(improved, e, plant_values(e, joint)));
    if (!written) out.beyond.push_back(std::move(e));
  }
  anchor_at_stops(out.plant, report);
  return out;
}

/// A comment has no control characters, and names are data.
std::string comment(std::string text) {
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), control, ' ');
  return "# " + text + "\n";
}

std::string comment_for(const NamedEffect& e) {
  std::string text = fmt::format("  {} ({}): {}", e.joint, e.stage, e.id);
  for (const NamedParameter& p : e.parameters) {
    if (!p.name.starts_with("begin_"))
      text += fmt::format(", {} = {:.6g} {}", p.name, p.value, p.unit);
  }
  return comment(std::move(text));
}

}  // namespace

physics::Plant improved_plant(const physics::Plant& plant, const Report& report) {
  return improve(plant, report).plant;
}

std::string improved_plant_text(const physics::Plant& plant, const Report& report) {
  const Improved improved = improve(plant, report);
  std::string text = comment(plant.robot.name + ", improved by `ravencal diagnose`.") + "\n" +
                     physics::plant_text(improved.plant);
  if (!improved.beyond.empty()) text += "\n# Found, but beyond what `ravencal simulate` can run:\n";
  for (const NamedEffect& e : improved.beyond) text += comment_for(e);
  return text;
}

}  // namespace ravencal::diagnose
