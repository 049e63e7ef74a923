// SPDX-License-Identifier: Apache-2.0
#include "diagnose/vocabulary/scales.hpp"

#include <algorithm>
#include <cmath>

#include "physics/effects/effect_spec.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::diagnose {
namespace {

/// A prismatic joint's position beside a revolute one's: the radius of a capstan and its pulleys.
constexpr double kMetresPerRad = 0.08;
/// Dry friction of drives whose plants state none, N m and N.
constexpr double kUsualFriction_n_m = 1.7;
constexpr double kUsualFriction_n = 15.0;
/// Share of a drive's recorded effort that its friction usually is.
constexpr double kFrictionShare = 0.5;
/// Share of the friction below which a load is none.
constexpr double kLeastLoad = 1e-6;
constexpr double kUsualQuantum_rad = 1e-4;

/// Loads that act on that joint or on any, and are not zero throughout.
void add_loads(const Track& track, const std::string& joint, std::vector<LoadScale>& loads) {
  for (const RecordedLoad& load : track.loads) {
    if (!load.joint.empty() && load.joint != joint) continue;
    const double largest = track.forced.load(load.name).cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) continue;
    const auto known = std::find_if(loads.begin(), loads.end(), [&](const LoadScale& other) {
      return other.name == load.name;
    });
    if (known == loads.end())
      loads.push_back({load.name, load.unit, largest});
    else
      known->largest = std::max(known->largest, largest);
  }
}

}  // namespace

Scales scales_of(const physics::Plant& plant, std::size_t j, const Likelihood& training) {
  const physics::Joint& joint = plant.joints[j];
  Scales s;
  s.joint = j;
  s.desired_rate = training.base().laws[j].desired_rate;
  s.prismatic = joint.kind == physics::JointKind::kPrismatic;
  for (const Channel& channel : training.channels()) {
    if (channel.joint != j) continue;
    s.effort = s.effort || channel.kind == ChannelKind::kDrive;
    s.truth = s.truth || channel.kind == ChannelKind::kPosition;
    s.law = s.law || channel.kind == ChannelKind::kLaw;
  }
  s.position = s.prismatic ? kMetresPerRad : 1.0;
  const double friction =
      joint.parameter("coulomb_friction", "level") + joint.parameter("joint_friction", "level");
  s.quantum = joint.joint_encoder_resolution_ji > 0.0 ? joint.joint_encoder_resolution_ji
                                                      : kUsualQuantum_rad * s.position;
  const auto law = physics::servo_law(joint);
  double lowest = 1e300, highest = -1e300, squares = 0.0, rows = 0.0;
  for (std::size_t r = 0; r < training.tracks().size(); ++r) {
    const Track& track = training.tracks()[r];
    const Eigen::VectorXd& q = track.forced.motors[j].q;
    lowest = std::min(lowest, q.minCoeff());
    highest = std::max(highest, q.maxCoeff());
    s.moves = s.moves || !track.at_rest;
    s.tracking = s.tracking || track.joints[j].tracking;
    const Eigen::VectorXd& followed = track.forced.followed[j];
    s.followed = s.followed || followed.size() > 0;
    for (const double effort : followed.size() > 0 ? Eigen::VectorXd(law->position * (followed - q))
                                                   : track.joints[j].effort) {
      if (!std::isfinite(effort)) continue;
      s.greatest_effort = std::max(s.greatest_effort, std::abs(effort));
      squares += effort * effort;
      rows += 1.0;
    }
    s.length_s = std::max(s.length_s, track.forced.t_s[track.rows() - 1]);
    add_loads(track, joint.name, s.loads);
    s.weight_load =
        std::max(s.weight_load, training.predictor(r).link_load(plant, j).cwiseAbs().maxCoeff());
  }
  if (s.followed) s.truth = false;
  s.load = s.prismatic ? kUsualFriction_n : kUsualFriction_n_m;
  if (squares > 0.0) s.load = kFrictionShare * std::sqrt(squares / rows);
  if (friction > 0.0) s.load = friction;
  s.lowest = lowest;
  s.range = std::max(1e-6, highest - lowest);
  if (s.weight_load < kLeastLoad * s.load) s.weight_load = 0.0;
  const auto& g = plant.robot.gravity_m_per_s2;
  const bool gravity = g[0] != 0.0 || g[1] != 0.0 || g[2] != 0.0;
  s.weight = s.weight_load > 0.0 && gravity;
  s.unknown_weight = s.weight_load <= 0.0 && gravity;
  return s;
}

std::string unit_of(const std::string& effect, const std::string& parameter, bool prismatic) {
  const physics::EffectSpec* spec = physics::find_effect_spec(effect);
  if (spec == nullptr) return "";
  const auto kind = prismatic ? physics::JointKind::kPrismatic : physics::JointKind::kRevolute;
  for (const physics::ParameterSpec& p : spec->parameters) {
    if (p.name != parameter) continue;
    std::string unit(physics::unit_suffix(p.dimension, kind));
    // Newtons are an upper-case N.
    for (std::size_t i = 0; i < unit.size(); ++i)
      if (unit[i] == 'n' && (i + 1 == unit.size() || unit[i + 1] == '_')) unit[i] = 'N';
    if (unit.starts_with('_')) unit.erase(0, 1);
    return unit;
  }
  return "";
}

}  // namespace ravencal::diagnose
