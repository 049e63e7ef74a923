// SPDX-License-Identifier: Apache-2.0
#include "diagnose/vocabulary/setters.hpp"

#include <array>
#include <cmath>
#include <utility>

namespace ravencal::diagnose {

Setter in_plant(std::size_t joint, std::string effect, std::string parameter, std::string from) {
  return [joint, effect = std::move(effect), parameter = std::move(parameter),
          from = std::move(from)](State& state, double value) {
    set_plant_number(state.plant, joint, effect, parameter, value, from);
  };
}

Setter as_compliance(std::size_t joint) {
  return [joint](State& state, double value) {
    set_plant_number(state.plant, joint, "compliance", "stiffness",
                     value > 0.0 ? 1.0 / value : 0.0);
  };
}

Setter as_wave(std::size_t joint, std::string effect, std::size_t part) {
  return [joint, effect = std::move(effect), part](State& state, double value) {
    const double amplitude = plant_number(state.plant, joint, effect, "amplitude");
    const double phase = plant_number(state.plant, joint, effect, "phase");
    std::array parts = {amplitude * std::cos(phase), amplitude * std::sin(phase)};
    parts.at(part) = value;
    set_plant_number(state.plant, joint, effect, "amplitude", std::hypot(parts[0], parts[1]));
    set_plant_number(state.plant, joint, effect, "phase", std::atan2(parts[1], parts[0]));
  };
}

Parameter parameter_of(const Scales& scales, const std::string& effect, const std::string& name,
                       Reaches reaches, const std::string& from) {
  Parameter p;
  p.effect = effect;
  p.name = name;
  p.unit = unit_of(effect, name, scales.prismatic);
  p.joint = scales.joint;
  p.reaches = reaches;
  p.set = in_plant(scales.joint, effect, name, from);
  return p;
}

}  // namespace ravencal::diagnose
