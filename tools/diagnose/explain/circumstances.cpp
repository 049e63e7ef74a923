// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/circumstances.hpp"

#include <algorithm>
#include <cmath>
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
                                    const std::string& whose, bool accelerated) {
  Circumstance q{"position" + whose, positions}, v{"velocity" + whose, {}},
      a{"acceleration" + whose, {}};
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

double usual_speed(const View& view, std::size_t joint) {
  double squares = 0.0, rows = 0.0;
  for (const Track& track : view.rows.tracks()) {
    squares += track.forced.motors[joint].v.squaredNorm();
    rows += static_cast<double>(track.rows());
  }
  return std::sqrt(squares / std::max(1.0, rows));
}

VectorXd held_s(const Track& track, std::size_t joint, double least_speed) {
  const VectorXd& v = track.forced.motors[joint].v;
  VectorXd held = VectorXd::Zero(track.rows());
  for (Index i = 1; i < track.rows(); ++i) {
    const bool rests =
        std::abs(v[i]) < least_speed && track.forced.fresh[static_cast<std::size_t>(i)] == 0;
    if (rests) held[i] = held[i - 1] + track.forced.t_s[i] - track.forced.t_s[i - 1];
  }
  return held;
}

/// What the plant says is passed on or, without a cable, what the links ask for.
VectorXd load_of(const physics::Plant& plant, const physics::Predictor& predictor,
                 const physics::Prediction& prediction, std::size_t joint) {
  const VectorXd& tension = prediction.tension[joint];
  if (tension.size() > 0 && tension.cwiseAbs().maxCoeff() > 0.0) return tension;
  VectorXd load = predictor.link_load(plant, joint);
  if (load.size() == 0 || load.cwiseAbs().maxCoeff() == 0.0) return {};
  return load;
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
  Circumstances out;
  out.own = motion_of(rows, positions_of(channel.joint), "", true);
  Circumstance load{"load", {}};
  bool known = false;
  for (std::size_t r = 0; r < rows.tracks().size(); ++r) {
    load.value.push_back(
        tent(rows.predictor(r).predict(plant).tension[channel.joint], rows.tracks()[r].tent_rows));
    known = known || !load.value.back().isZero(0.0);
  }
  if (known) out.own.push_back(std::move(load));
  for (std::size_t k = 0; k < plant.joints.size(); ++k) {
    if (k == channel.joint) continue;
    for (Circumstance& c : motion_of(rows, positions_of(k), " of " + plant.joints[k].name, false))
      out.others.push_back(std::move(c));
  }
  return out;
}

std::vector<ByRecording> transmitted_loads(const View& view) {
  std::vector<ByRecording> loads(view.given.joints.size());
  for (std::size_t r = 0; r < view.rows.tracks().size(); ++r) {
    const physics::Predictor& predictor = view.rows.predictor(r);
    const physics::Prediction prediction = predictor.predict(view.given);
    for (std::size_t j = 0; j < loads.size(); ++j) {
      const VectorXd load = load_of(view.given, predictor, prediction, j);
      loads[j].push_back(load.size() > 0 ? tent(load, view.rows.tracks()[r].tent_rows) : load);
    }
  }
  for (ByRecording& of_joint : loads) {
    const bool known = std::all_of(of_joint.begin(), of_joint.end(),
                                   [](const VectorXd& load) { return load.size() > 0; });
    if (!known) of_joint.clear();
  }
  return loads;
}

ChannelRows channel_rows(const View& view, std::size_t channel,
                         const std::vector<ByRecording>& loads) {
  const Channel& c = view.rows.channels()[channel];
  const double least_speed = kRestOfUsualSpeed * usual_speed(view, c.joint);
  ByRecording t_s, position, speed, held;
  ChannelRows out;
  for (std::size_t r = 0; r < view.rows.tracks().size(); ++r) {
    const Track& track = view.rows.tracks()[r];
    const physics::Motion& motor = track.forced.motors[c.joint];
    t_s.emplace_back(track.forced.t_s.array() + track.begins_s);
    position.push_back(motor.q);
    speed.push_back(motor.v);
    held.push_back(held_s(track, c.joint, least_speed));
    const auto blocks = view.rows.blocks().begin() + c.first[r];
    out.blocks.insert(out.blocks.end(), blocks, blocks + static_cast<Index>(c.used[r].size()));
    out.recordings.insert(out.recordings.end(), c.used[r].size(), r);
  }
  out.t_s = used_rows(c, t_s);
  out.position_ji = used_rows(c, position);
  out.speed_ji_per_s = used_rows(c, speed);
  out.hold_s = used_rows(c, held);
  if (!loads[c.joint].empty()) out.load_ji = used_rows(c, loads[c.joint]);
  return out;
}

}  // namespace ravencal::diagnose
