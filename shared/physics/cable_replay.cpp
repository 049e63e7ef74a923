// SPDX-License-Identifier: Apache-2.0
#include "physics/cable_replay.hpp"

#include <algorithm>
#include <cmath>

#include "physics/effects/backlash.hpp"
#include "physics/effects/slip_element.hpp"

namespace ravencal::physics {

using Eigen::Index;
using Eigen::VectorXd;

CableReplay::CableReplay(const CableNumbers& numbers, const CableFloors& floors)
    : n_(numbers),
      stiffness_(1.0 / std::max(numbers.compliance, floors.compliance)),
      presliding_(std::max(numbers.friction_presliding, floors.presliding)) {}

void CableReplay::start(double motor, double load) {
  creep_ = n_.creep_start * n_.creep_compliance * load;
  stretch_ = 0.0;
  joint_ = motor;
  bristle_ = 0.0;
  rate_slope_ = 0.0;
  // Strands carry what they carry; the spring beside them takes the rest.
  strand_stiffness_ = 0.0;
  const double carried = n_.strand_start * n_.strand_stiffness * open_width();
  if (n_.friction_start) {
    const double sagged = balance(motor, load - carried + *n_.friction_start * level_at(load), 0.0);
    joint_ = motor - creep_ - sagged;
    bristle_ = *n_.friction_start;
    settle(motor, sagged);
  } else {
    settle(motor, balance(motor, load - carried, level_at(load)));
  }
  for (std::size_t i = 0; i < kStrands; ++i)
    strands_[i] = n_.strand_start * strand_limit(n_.strand_yield, i);
  open_ = n_.strand_start;
  strand_stiffness_ = n_.strand_stiffness;
  settle(motor, stretch_);
}

double CableReplay::step(double motor, double load, double dt_s) {
  if (n_.creep_compliance > 0.0) {
    creep_ += (1.0 - std::exp(-dt_s / n_.creep_time_s)) * (n_.creep_compliance * elastic_ - creep_);
  }
  rate_slope_ = dt_s > 0.0 ? n_.damping / dt_s : 0.0;
  settle(motor, balance(motor, load, level_at(load)));
  return motor - joint_;
}

/// Effort at stretch s and its slope: the spring, to which the gap leaves what it does not take,
/// and strands, which bridge the gap.
CableReplay::Value CableReplay::elastic(double s) const {
  const bool closed = std::abs(s) >= n_.gap_half_width;
  Value v{stiffness_ * through_gap(s, n_.gap_half_width), closed ? stiffness_ : 0.0};
  if (strand_stiffness_ <= 0.0) return v;
  const double moved = s - stretch_;
  const double share =
      (1.0 - n_.strand_openness) * strand_stiffness_ / static_cast<double>(kStrands);
  for (std::size_t i = 0; i < kStrands; ++i) {
    const double limit = strand_limit(n_.strand_yield, i);
    v.f += share * slipped(strands_[i], moved, limit);
    if (std::abs(strands_[i] + moved) < limit) v.slope += share;
  }
  if (n_.strand_openness <= 0.0) return v;
  const double open = n_.strand_openness * strand_stiffness_;
  const double level = open_level(moved);
  v.f += open * open_width() * level;
  v.slope += open * (moved < 0.0 ? 1.0 + level : 1.0 - level);
  return v;
}

/// Dahl's law with the slope and the limit of the slip elements together.
double CableReplay::open_width() const {
  return n_.strand_yield * (kStrands + 1.0) / (2.0 * kStrands);
}

double CableReplay::open_level(double moved) const {
  const double side = moved < 0.0 ? -1.0 : 1.0;
  return side - (side - open_) * std::exp(-std::abs(moved) / open_width());
}

/// The same with what the cable resists to how fast it stretches.
CableReplay::Value CableReplay::effort(double s) const {
  const double gap = n_.gap_half_width;
  Value v = elastic(s);
  v.f += rate_slope_ * (through_gap(s, gap) - through_gap(stretch_, gap));
  if (std::abs(s) >= gap) v.slope += rate_slope_;
  return v;
}

double CableReplay::level_at(double load) const {
  return n_.friction_level + n_.friction_load_share * std::abs(load);
}

/// Effort balance of the joint, rising in s: cable minus load minus friction.
CableReplay::Value CableReplay::imbalance(double s, double motor, double load, double level) const {
  Value v = effort(s);
  v.f -= load;
  if (level > 0.0) {
    const double moved = (motor - creep_ - s - joint_) / presliding_;
    v.f -= level * slipped(bristle_, moved);
    if (std::abs(bristle_ + moved) < 1.0) v.slope += level / presliding_;
  }
  return v;
}

/// Newton within a bracket: the balance is piecewise linear and rises.
double CableReplay::balance(double motor, double load, double level) const {
  const double span = n_.gap_half_width + std::abs(stretch_) +
                      (std::abs(load) + level) / stiffness_ +
                      (n_.strand_stiffness * n_.strand_yield) / stiffness_ + 1e-15;
  double low = -span;
  double high = span;
  double s = std::clamp(stretch_, low, high);
  for (int i = 0; i < 60; ++i) {
    const Value v = imbalance(s, motor, load, level);
    if (std::abs(v.f) <= 1e-10 * (std::abs(load) + level + 1e-12)) break;
    (v.f > 0.0 ? high : low) = s;
    const double newton = v.slope > 0.0 ? s - v.f / v.slope : low - 1.0;
    s = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (high - low < 1e-13 * span) break;
  }
  return s;
}

/// Takes the stretch over.
void CableReplay::settle(double motor, double next) {
  tension_ = effort(next).f;
  elastic_ = elastic(next).f;
  const double moved = next - stretch_;
  for (std::size_t i = 0; i < kStrands; ++i)
    strands_[i] = slipped(strands_[i], moved, strand_limit(n_.strand_yield, i));
  if (n_.strand_openness > 0.0) open_ = open_level(moved);
  stretch_ = next;
  const double joint = motor - creep_ - stretch_;
  bristle_ = slipped(bristle_, (joint - joint_) / presliding_);
  joint_ = joint;
}

CableNumbers cable_numbers(const Joint& joint) {
  CableNumbers n;
  const double stiffness = joint.parameter("compliance", "stiffness");
  if (stiffness > 0.0) n.compliance = 1.0 / stiffness;
  n.damping = joint.parameter("compliance", "damping");
  n.gap_half_width = joint.parameter("backlash", "half_width");
  n.strand_stiffness = joint.parameter("hysteresis", "stiffness");
  n.strand_yield = joint.parameter("hysteresis", "yield");
  n.creep_compliance = joint.parameter("creep", "compliance");
  n.creep_time_s = std::max(1e-3, joint.parameter("creep", "time"));
  n.friction_level = joint.parameter("joint_friction", "level");
  n.friction_load_share = joint.parameter("joint_friction", "load_share");
  n.friction_presliding = joint.parameter("joint_friction", "presliding");
  return n;
}

CableMotion replay_cable(const CableDrive& d, const CableNumbers& numbers) {
  const Index rows = d.motor.size();
  CableMotion out{VectorXd::Zero(rows), VectorXd::Zero(rows)};
  VectorXd load = d.weight.size() > 0 ? VectorXd(numbers.weight_scale * d.weight)
                                      : VectorXd(VectorXd::Zero(rows));
  if (d.inertial.size() > 0) load += d.inertial;
  const double greatest = load.cwiseAbs().maxCoeff() + numbers.friction_level;
  if (greatest <= 0.0) return out;
  // A stiff cable stretches by a thousandth of what counts as motion.
  CableReplay cable(numbers, {1e-3 * d.rest_width / greatest, 0.2 * d.rest_width});
  for (Index i = 0; i < rows; ++i) {
    if (i == 0 || d.fresh[static_cast<std::size_t>(i)] != 0) {
      cable.start(d.motor[i], load[i]);
      out.stretch[i] = cable.offset(d.motor[i]);
    } else {
      out.stretch[i] = cable.step(d.motor[i], load[i], d.t_s[i] - d.t_s[i - 1]);
    }
    out.tension[i] = cable.tension();
  }
  return out;
}

VectorXd cable_friction(const VectorXd& t_s, const VectorXd& position,
                        const std::vector<char>& fresh, const CableNumbers& numbers) {
  if (position.size() == 0 || numbers.friction_level <= 0.0) return VectorXd::Zero(position.size());
  const double range = position.maxCoeff() - position.minCoeff();
  // As a series' width of rest (diagnose), noise aside.
  const double rest_width = std::max(5e-4 * range, 1e-12);
  return replay_cable({t_s, position, {}, {}, fresh, rest_width}, numbers).tension;
}

}  // namespace ravencal::physics
