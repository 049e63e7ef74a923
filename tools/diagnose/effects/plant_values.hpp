// SPDX-License-Identifier: Apache-2.0
//
// What a finding says to the plant that `simulate` runs.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Parameters of a plant's effect, by name without unit.
using PlantValues = std::map<std::string, double, std::less<>>;

/// The value that the improved plant takes; 0 where the finding has none of that name.
inline double plant_value(const NamedEffect& effect, std::string_view name) {
  const NamedParameter* found = find_parameter(effect, name);
  return found != nullptr ? found->in_plant() : 0.0;
}

/// Parameters that have the same names in the finding and in the plant.
inline PlantValues same_values(const NamedEffect& effect,
                               std::initializer_list<const char*> names) {
  PlantValues values;
  for (const char* name : names) values[name] = plant_value(effect, name);
  return values;
}

/// A loop that positions alone show, for joints without a cable in the plant.
inline PlantValues loop_values(const NamedEffect& effect) {
  const std::string suffix = effect.from.empty() ? "" : "_from_" + effect.from;
  PlantValues values;
  for (const char* name : {"half_loop", "half_loop_narrow", "half_loop_wide", "width", "stretch"}) {
    if (const NamedParameter* found = find_parameter(effect, name + suffix))
      values[name] = found->in_plant();
  }
  return values;
}

/// One finding on its way into the plant.
struct PlantFinding {
  const physics::Plant& plant;  ///< as it was
  std::size_t joint;
  const NamedEffect& effect;
  const std::vector<NamedEffect>& named;  ///< all effects of the report
};

/// Gives the joint's effect of that id and source the values; it is made if absent. False, and
/// nothing is changed, if the vocabulary has none of them or no plant may have what would come out.
bool set_values(physics::Joint& joint, const NamedEffect& effect, const PlantValues& values);

}  // namespace ravencal::diagnose
