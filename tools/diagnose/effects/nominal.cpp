// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/nominal.hpp"

#include <algorithm>

#include "diagnose/effects/nominal_builder.hpp"

namespace ravencal::diagnose {
physics::JointSignals signals_of(const Series& s) {
  const auto other = [&s](const std::string& name) {
    if (name == s.joint) return s.motion.q;
    for (const std::vector<Companion>* list : {&s.others, &s.loads}) {
      for (const Companion& companion : *list)
        if (companion.name == name) return companion.value;
    }
    return Eigen::VectorXd();
  };
  return {s.t_s, s.fresh, s.motion.q, other, s.driven};
}

Nominal nominal_of(const Series& series, const physics::Plant& plant) {
  NominalBuilder builder(series, plant);
  for (const EffectKind* kind : effect_kinds()) kind->predict(builder);
  // Effects that the plant describes by their shape alone; nobody says how far they may be off.
  if (builder.in(Stage::kTransmission) || builder.in(Stage::kTracking))
    builder.add(physics::shape_error(builder.joint(), signals_of(series)));
  return builder.take();
}

bool plant_has(const physics::Plant& plant, const std::string& joint, const std::string& id,
               const std::string& from) {
  const auto index = plant.joint_index(joint);
  if (!index) return false;
  const physics::Joint& j = plant.joints[*index];
  return std::any_of(j.effects.begin(), j.effects.end(), [&](const physics::Effect& effect) {
    return effect.id == id && (from.empty() || effect.from == from);
  });
}

}  // namespace ravencal::diagnose
