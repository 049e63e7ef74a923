// SPDX-License-Identifier: Apache-2.0
#include "diagnose/model/state.hpp"

#include <algorithm>

namespace ravencal::diagnose {
namespace {

auto find(auto& effects, const std::string& id, const std::string& from) {
  return std::find_if(effects.begin(), effects.end(), [&](const physics::Effect& effect) {
    return effect.id == id && effect.from == from;
  });
}

}  // namespace

State initial_state(const physics::Plant& plant, std::size_t recordings) {
  State state;
  state.plant = plant;
  state.circumstances.assign(recordings,
                             std::vector<physics::JointCircumstances>(plant.joints.size()));
  state.laws.resize(plant.joints.size());
  return state;
}

double plant_number(const physics::Plant& plant, std::size_t joint, const std::string& effect,
                    const std::string& parameter, const std::string& from) {
  const auto& effects = plant.joints[joint].effects;
  const auto at = find(effects, effect, from);
  if (at == effects.end()) return 0.0;
  const auto value = at->parameters.find(parameter);
  return value == at->parameters.end() ? 0.0 : value->second;
}

void set_plant_number(physics::Plant& plant, std::size_t joint, const std::string& effect,
                      const std::string& parameter, double value, const std::string& from) {
  auto& effects = plant.joints[joint].effects;
  auto at = find(effects, effect, from);
  if (at == effects.end()) at = effects.insert(effects.end(), {effect, from, {}});
  at->parameters[parameter] = value;
}

}  // namespace ravencal::diagnose
