// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/circumstances.hpp"

#include <algorithm>
#include <utility>

#include "diagnose/track/filter.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd rate_of(const Track& track, const VectorXd& q) {
  VectorXd v = first_difference(q, track.period_s);
  // A difference across the start of an episode is no motion.
  for (Index i = 1; i < v.size(); ++i)
    if (track.forced.fresh[static_cast<std::size_t>(i)] != 0) v[i] = v[i - 1] = 0.0;
  return v;
}

/// Position and velocity, and on request the acceleration.
std::vector<Circumstance> motion_of(const Likelihood& rows, const ByRecording& positions,
                                    const std::string& unit, const std::string& whose,
                                    bool accelerated) {
  Circumstance q{"position" + whose, unit, positions}, v{"velocity" + whose, unit + "_per_s", {}},
      a{"acceleration" + whose, unit + "_per_s2", {}};
  for (std::size_t r = 0; r < positions.size(); ++r) {
    const Track& track = rows.tracks()[r];
    const VectorXd rate = rate_of(track, positions[r]);
    v.value.push_back(tent(rate, track.tent_rows));
    if (accelerated) a.value.push_back(tent(rate_of(track, rate), track.tent_rows));
  }
  std::vector<Circumstance> out{std::move(q), std::move(v)};
  if (accelerated) out.push_back(std::move(a));
  return out;
}

std::string position_unit_of(const physics::Joint& joint) {
  return joint.kind == physics::JointKind::kPrismatic ? "m" : "rad";
}

}  // namespace

Circumstances circumstances_of(const Channel& channel, const Likelihood& rows,
                               const physics::Plant& plant) {
  const auto positions_of = [&](std::size_t joint) {
    ByRecording out;
    for (std::size_t r = 0; r < rows.tracks().size(); ++r)
      out.push_back(channel.kind == ChannelKind::kPosition
                        ? rows.predictor(r).believed()[joint]
                        : rows.tracks()[r].forced.motors[joint].q);
    return out;
  };
  const physics::Joint& joint = plant.joints[channel.joint];
  Circumstances out;
  out.own = motion_of(rows, positions_of(channel.joint), position_unit_of(joint), "", true);
  Circumstance load{"load", joint.kind == physics::JointKind::kPrismatic ? "N" : "N_m", {}};
  bool known = false;
  for (std::size_t r = 0; r < rows.tracks().size(); ++r) {
    load.value.push_back(
        tent(rows.predictor(r).predict(plant).tension[channel.joint], rows.tracks()[r].tent_rows));
    known = known || !load.value.back().isZero(0.0);
  }
  if (known) out.own.push_back(std::move(load));
  for (std::size_t k = 0; k < plant.joints.size(); ++k) {
    if (k == channel.joint) continue;
    for (Circumstance& c : motion_of(rows, positions_of(k), position_unit_of(plant.joints[k]),
                                     " of " + plant.joints[k].name, false))
      out.others.push_back(std::move(c));
  }
  return out;
}

}  // namespace ravencal::diagnose
