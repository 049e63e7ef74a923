// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/nominal_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Cosines over a recording that stand for a slow change; faster ones are noise like any other.
constexpr int kSlowCosines = 8;
/// Times of a change beyond which its slow cosines hold less than half of its variance.
constexpr double kLongForSlow = 20.0;
/// A plant knows by how much its numbers change to a factor of two.
constexpr double kKnownDeviation = 2.0;
/// Relative change over which a replay is differentiated.
constexpr double kStep = 0.05;

/// The drive feels the cable's tension where a weight or friction behind it acts; positions show
/// its stretch.
bool acts(const Series& s) {
  if (s.stage == Stage::kDrive) return s.weight.size() > 0 || s.cable.friction_level > 0.0;
  return s.stage == Stage::kTransmission && !s.cable.rigid();
}

}  // namespace

NominalBuilder::NominalBuilder(const Series& series, const physics::Plant& plant)
    : s_(series), plant_(plant), joint_(plant.joints[plant.joint_index(series.joint).value_or(0)]) {
  nominal_.prediction = VectorXd::Zero(s_.rows());
  if (in(Stage::kDrive) && s_.others_friction.size() > 0) add(s_.as_seen(s_.others_friction));
  if (acts(s_)) {
    replay_ = replay_of(s_.cable);
    add(replay_);
  }
}

VectorXd NominalBuilder::effort_of(double level, const DryFriction& law) const {
  return level * s_.as_seen(dry_friction(s_, law));
}

VectorXd NominalBuilder::replay_of(const CableNumbers& cable) const {
  if (in(Stage::kDrive)) return s_.as_seen(cable_tension(s_, cable));
  return -cable_stretch(s_, cable);
}

NominalTerm* NominalBuilder::linear(const EffectKind& kind, const std::string& parameter,
                                    const std::string& unit, double value, const VectorXd& column) {
  if (value == 0.0) return nullptr;
  add(value * column);
  nominal_.terms.push_back({kind.id(), parameter, unit, value,
                            tolerance_of(joint_, kind.id(), parameter), value * column});
  return &nominal_.terms.back();
}

NominalTerm* NominalBuilder::of_cable(const EffectKind& kind, const std::string& parameter,
                                      const std::string& unit, double value,
                                      const CableChange& change) {
  if (value == 0.0 || !has_cable()) return nullptr;
  CableNumbers changed = s_.cable;
  change(changed, 1.0 + kStep);
  nominal_.terms.push_back({kind.id(), parameter, unit, value,
                            tolerance_of(joint_, kind.id(), parameter),
                            (replay_of(changed) - replay_) / kStep});
  return &nominal_.terms.back();
}

NominalTerm* NominalBuilder::form(const EffectKind& kind, const std::string& parameter,
                                  const std::string& unit, double value, double deviation,
                                  VectorXd column) {
  nominal_.terms.push_back({kind.id(), parameter, unit, value, deviation, std::move(column), true});
  return &nominal_.terms.back();
}

void NominalBuilder::slow_changes(const EffectKind& kind, const std::string& parameter,
                                  const std::string& unit, const VectorXd& column) {
  const double deviation = joint_.parameter(kind.id(), parameter);
  const double time_s = std::max(1.0, joint_.parameter(kind.id(), parameter + "_time"));
  if (deviation <= 0.0) return;
  for (Index first = 0, last = 0; first < s_.rows(); first = last) {
    const auto recording = s_.recording[static_cast<std::size_t>(first)];
    while (last < s_.rows() && s_.recording[static_cast<std::size_t>(last)] == recording) ++last;
    const Index rows = last - first;
    const double length_s = s_.t_s[last - 1] - s_.t_s[first];
    if (s_.held_out[static_cast<std::size_t>(first)] != 0 || length_s <= 0.0) continue;
    if (length_s > kLongForSlow * time_s) continue;
    for (int k = 1; k <= kSlowCosines; ++k) {
      const double w = std::numbers::pi * k / length_s;
      const double spread = std::sqrt(4.0 * deviation * deviation * time_s /
                                      (1.0 + w * w * time_s * time_s) / length_s);
      VectorXd part = VectorXd::Zero(s_.rows());
      part.segment(first, rows) = kKnownDeviation * spread * column.segment(first, rows).array() *
                                  (w * (s_.t_s.segment(first, rows).array() - s_.t_s[first])).cos();
      form(kind, parameter, unit, 0.0, 1.0, std::move(part));
    }
  }
}

Nominal NominalBuilder::take() {
  if (effort_scale_ != 1.0) {
    nominal_.prediction /= effort_scale_;
    for (NominalTerm& term : nominal_.terms) term.column /= effort_scale_;
  }
  return std::move(nominal_);
}

}  // namespace ravencal::diagnose
