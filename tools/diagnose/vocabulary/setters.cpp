// SPDX-License-Identifier: Apache-2.0
#include "diagnose/vocabulary/setters.hpp"

#include <cmath>
#include <utility>

namespace ravencal::diagnose {
namespace {

/// Changes sine and cosine of the effect, of which the plant has amplitude and phase.
template <typename Change>
void change_wave(State& state, std::size_t joint, const std::string& effect, Change&& change) {
  const double amplitude = plant_number(state.plant, joint, effect, "amplitude");
  const double phase = plant_number(state.plant, joint, effect, "phase");
  double sine = amplitude * std::cos(phase);
  double cosine = amplitude * std::sin(phase);
  change(sine, cosine);
  set_plant_number(state.plant, joint, effect, "amplitude", std::hypot(sine, cosine));
  set_plant_number(state.plant, joint, effect, "phase", std::atan2(cosine, sine));
}

}  // namespace

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

Setter as_sine(std::size_t joint, std::string effect) {
  return [joint, effect = std::move(effect)](State& state, double value) {
    change_wave(state, joint, effect, [&](double& sine, double&) { sine = value; });
  };
}

Setter as_cosine(std::size_t joint, std::string effect) {
  return [joint, effect = std::move(effect)](State& state, double value) {
    change_wave(state, joint, effect, [&](double&, double& cosine) { cosine = value; });
  };
}

Setter of_mass(std::size_t joint, double given_kg) {
  return [=](State& state, double ratio) {
    state.plant.joints[joint].link.mass_kg = (1.0 + ratio) * given_kg;
  };
}

Setter of_motor_inertia(std::size_t joint, double given_kg_m2) {
  return [=](State& state, double ratio) {
    state.plant.joints[joint].motor_inertia_kg_m2 = (1.0 + ratio) * given_kg_m2;
  };
}

Setter of_gain(std::size_t joint, double given_n_m_per_rad) {
  return [=](State& state, double ratio) {
    state.plant.joints[joint].controller->kp_n_m_per_rad = (1.0 + ratio) * given_n_m_per_rad;
  };
}

Setter of_damping(std::size_t joint, double given_n_m_s_per_rad) {
  return [=](State& state, double ratio) {
    state.plant.joints[joint].controller->kd_n_m_s_per_rad = (1.0 + ratio) * given_n_m_s_per_rad;
  };
}

Setter of_payload(double given_kg) {
  return [=](State& state, double value) { state.plant.payload.mass_kg = given_kg + value; };
}

}  // namespace ravencal::diagnose
