// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/plant_values.hpp"

#include <algorithm>
#include <utility>

#include "diagnose/effects/effect_kind.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::diagnose {

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

bool EffectKind::improve(physics::Plant& improved, const PlantFinding& finding) const {
  const NamedEffect& e = finding.effect;
  physics::Joint& joint = improved.joints[finding.joint];
  if (!e.out_of_tolerance)
    return set_values(joint, e, plant_values(e, finding.plant.joints[finding.joint]));
  const NamedParameter& p = e.parameters.front();
  return set_values(joint, e, {{p.name, p.in_plant()}});
}

}  // namespace ravencal::diagnose
