// SPDX-License-Identifier: Apache-2.0
#include "conceal/kinds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace ravencal::conceal {
namespace {

using Eigen::Index;
using physics::Dimension;

constexpr std::array<Kind, 11> kKinds = {{
    {"gain_error", "ratio", true},
    {"coupling", "error", true},
    {"joint_friction", "level"},
    {"hysteresis", "stiffness"},
    {"creep", "compliance"},
    {"eccentricity", "amplitude"},
    {"coulomb_friction", "level"},
    {"viscous_friction", "damping"},
    {"asymmetric_friction", "level_difference", true},
    {"torque_constant", "ratio", true},
    {"torque_ripple", "amplitude"},
}};

constexpr double kMostRatio = 0.4;
constexpr double kStartRatio = 0.02;

bool lacks(const physics::Joint& joint, std::string_view id) {
  return std::none_of(joint.effects.begin(), joint.effects.end(),
                      [id](const physics::Effect& effect) { return effect.id == id; });
}

double speed_of(const Observed& observed, Index joint) {
  const auto column = observed.traces.position.col(joint);
  const Index rows = column.size();
  return spread(column.tail(rows - 1) - column.head(rows - 1)) / observed.traces.row_s;
}

/// How much of the cable's stretch the motion works over, in the joint's unit.
double stretch_of(const physics::Joint& joint, const Observed& observed, Index i) {
  return spread(observed.traces.effort.col(i)) / joint.parameter("compliance", "stiffness");
}

/// Relaxes ten to forty times in the motion: a slower creep is seen too seldom to be told from an
/// offset or a ratio.
double creep_time_s(const Observed& observed, double share) {
  const double length_s = static_cast<double>(observed.traces.error.rows()) * observed.traces.row_s;
  return length_s / (10.0 * std::pow(4.0, share));
}

/// The size that would be seen as `target` scatters if all of it acted all the time.
double start_of(Dimension dimension, const physics::Joint& joint, const Observed& observed, Index i,
                double target) {
  const double effort = spread(observed.traces.effort.col(i));
  switch (dimension) {
    case Dimension::kPosition:
      return target * observed.error_scatter[i];
    case Dimension::kEffort:
      return target * observed.effort_scatter[i];
    case Dimension::kDamping:
      return target * observed.effort_scatter[i] / speed_of(observed, i);
    case Dimension::kCompliance:
      return target * observed.error_scatter[i] / effort;
    case Dimension::kStiffness:
      return 0.3 * joint.parameter("compliance", "stiffness");
    case Dimension::kCoupling:
      return target * observed.error_scatter[i] / spread(observed.traces.position.col(0));
    default:
      return kStartRatio;
  }
}

/// Friction that helps the motion on one side, or a ripple that locks the drive, is no arm.
double most_of(Dimension dimension, const physics::Joint& joint) {
  const double dry = joint.parameter("coulomb_friction", "level");
  if (dimension == Dimension::kRatio) return kMostRatio;
  if (dimension == Dimension::kEffort && dry > 0.0) return dry;
  return std::numeric_limits<double>::infinity();
}

}  // namespace

std::span<const Kind> kinds() { return kKinds; }

std::vector<std::size_t> joints_without(const Kind& kind, const physics::Plant& plant) {
  std::vector<std::size_t> joints;
  for (std::size_t i = kind.id == "coupling" ? 1 : 0; i < plant.joints.size(); ++i) {
    if (lacks(plant.joints[i], kind.id)) joints.push_back(i);
  }
  return joints;
}

Dimension dimension_of(std::string_view id, std::string_view parameter) {
  const physics::EffectSpec* spec = physics::find_effect_spec(id);
  if (spec == nullptr) return Dimension::kRatio;
  const auto it = std::find_if(spec->parameters.begin(), spec->parameters.end(),
                               [&](const auto& known) { return known.name == parameter; });
  return it == spec->parameters.end() ? Dimension::kRatio : it->dimension;
}

Place draw_place(const Kind& kind, std::size_t joint, const physics::Plant& plant,
                 const Observed& observed, double target, physics::RandomSource& random) {
  const physics::Joint& axis = plant.joints[joint];
  const auto i = static_cast<Index>(joint);
  const Dimension dimension = dimension_of(kind.id, kind.parameter);
  Place place;
  place.kind = &kind;
  place.joint = joint;
  place.effect.id = kind.id;
  place.start = start_of(dimension, axis, observed, i, target);
  place.most = most_of(dimension, axis);
  if (kind.both_signs && random.uniform() < 0.5) place.sign = -1.0;
  auto& more = place.effect.parameters;
  const double turns = axis.reduction / axis.gearbox_ratio;  // of the capstan per joint unit
  const double phase_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
  const double share = random.uniform();
  if (kind.id == "coupling")
    place.effect.from =
        plant
            .joints[std::min(joint - 1,
                             static_cast<std::size_t>(share * static_cast<double>(joint)))]
            .name;
  if (kind.id == "joint_friction") more["presliding"] = 0.1 * stretch_of(axis, observed, i);
  if (kind.id == "hysteresis") more["yield"] = (0.3 + 0.5 * share) * stretch_of(axis, observed, i);
  if (kind.id == "creep") more["time"] = creep_time_s(observed, share);
  if (kind.id == "eccentricity") more = {{"order", turns}, {"phase", phase_rad}};
  if (kind.id == "torque_ripple")
    more = {{"order", turns * (share < 0.5 ? 2.0 : 4.0)}, {"phase", phase_rad}};
  return place;
}

physics::Effect effect_of(const Place& place, double size) {
  physics::Effect effect = place.effect;
  effect.parameters[std::string(place.kind->parameter)] = place.sign * size;
  return effect;
}

physics::Plant with_effect(const physics::Plant& plant, std::size_t joint,
                           const physics::Effect& effect) {
  physics::Plant changed = plant;
  changed.joints[joint].effects.push_back(effect);
  return changed;
}

}  // namespace ravencal::conceal
