// SPDX-License-Identifier: Apache-2.0
//
// What can be hidden in a plant: an effect of the vocabulary that a joint does not have, grown from
// nothing by one of its parameters. What else the effect needs is drawn with it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "conceal/observed.hpp"
#include "physics/effects/effect_spec.hpp"
#include "physics/plant.hpp"
#include "physics/random_source.hpp"

namespace ravencal::conceal {

struct Kind {
  std::string_view id;
  std::string_view parameter;  ///< grows from nothing
  bool both_signs = false;
};

/// Of the vocabulary all but: homing_offset (a constant, which every homing draws anew), delay and
/// thermal_drift (the twin has neither within minutes), presliding and stribeck_friction (friction
/// has them in any case), compliance (the twin has no joint without a cable), saturation (the arm
/// stops following), backlash (`diagnose` called it unknown on this arm) and
/// load_dependent_friction (not tried). The choice of kinds therefore favours `diagnose`.
std::span<const Kind> kinds();

/// A kind at a place, with everything but its size. Units: the joint's.
struct Place {
  const Kind* kind = nullptr;
  std::size_t joint = 0;
  physics::Effect effect;  ///< without the parameter that grows
  double sign = 1.0;
  double start = 0.0;  ///< a first guess of the size, above zero
  double most = 0.0;   ///< beyond it the arm is no arm any more
};

/// Joints of the plant that lack the kind and can have it.
std::vector<std::size_t> joints_without(const Kind& kind, const physics::Plant& plant);

/// Draws what the kind needs at that joint. `observed`: the plant as it is, in the motion for which
/// the size will be chosen; `target`: the size, as a multiple of its scatter.
Place draw_place(const Kind& kind, std::size_t joint, const physics::Plant& plant,
                 const Observed& observed, double target, physics::RandomSource& random);

/// The effect with its size.
physics::Effect effect_of(const Place& place, double size);
/// The plant with the effect.
physics::Plant with_effect(const physics::Plant& plant, std::size_t joint,
                           const physics::Effect& effect);

/// Dimension of a parameter in the vocabulary.
physics::Dimension dimension_of(std::string_view id, std::string_view parameter);

}  // namespace ravencal::conceal
