// SPDX-License-Identifier: Apache-2.0
//
// Where a parameter stands in a state. Each returns what writes its value there.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "diagnose/model/state.hpp"

namespace ravencal::diagnose {

using Setter = std::function<void(State&, double value)>;

/// A parameter of an effect of the joint.
Setter in_plant(std::size_t joint, std::string effect, std::string parameter,
                std::string from = "");
/// The stiffness of the cable, as its compliance; 0: it does not stretch.
Setter as_compliance(std::size_t joint);
/// The sine or the cosine of an effect that a plant has as amplitude and phase.
Setter as_sine(std::size_t joint, std::string effect);
Setter as_cosine(std::size_t joint, std::string effect);
/// Relative change of the link's mass or of the motor's inertia, from the given plant's.
Setter of_mass(std::size_t joint, double given_kg);
Setter of_motor_inertia(std::size_t joint, double given_kg_m2);
/// Relative change of the servo's gain or damping, from the given plant's.
Setter of_gain(std::size_t joint, double given_n_m_per_rad);
Setter of_damping(std::size_t joint, double given_n_m_s_per_rad);
/// Mass on the tool, beyond the given plant's payload.
Setter of_payload(double given_kg);

/// A member of the circumstances of one joint, in one recording or in all.
template <typename Member>
Setter in_circumstances(std::size_t joint, std::optional<std::size_t> recording, Member member) {
  return [=](State& state, double value) {
    for (std::size_t r = 0; r < state.circumstances.size(); ++r)
      if (!recording || *recording == r) member(state.circumstances[r][joint]) = value;
  };
}

}  // namespace ravencal::diagnose
