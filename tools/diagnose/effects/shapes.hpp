// SPDX-License-Identifier: Apache-2.0
//
// Signals that several effects share.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/constants.hpp"
#include "diagnose/effects/effect_form.hpp"
#include "diagnose/series/operators.hpp"

namespace ravencal::diagnose {

inline std::string position_unit(const Series& s) { return s.prismatic ? "m" : "rad"; }
inline std::string effort_unit(const Series& s) { return s.prismatic ? "N" : "N_m"; }
/// Unit of an effort-like coefficient: an effort in the drive, a position where positions are
/// compared.
inline std::string amplitude_unit(const Series& s) { return s.unit; }
inline std::string per(const std::string& a, const std::string& b) { return a + "_per_" + b; }

/// Direction of motion, held at rest.
inline Eigen::VectorXd direction(const Series& s) {
  return direction_memory(s.motion.q, s.rest_width(), s.fresh);
}

/// How dry friction falls from rest to full motion.
enum class FallOff {
  kSlow,   ///< extra / (1 + (v / velocity)^2): half is gone at that velocity
  kSteep,  ///< extra exp(-(v / velocity)^2) (Armstrong-Helouvry et al., Automatica 1994)
};

/// Dry friction of the recorded motion, per its level at full speed: bristles that bend over
/// `displacement` and slip at 1 + extra at rest.
struct DryFriction {
  double displacement = 0.0;
  double extra = 0.0;  ///< relative to the level
  double velocity = 1.0;
  FallOff fall_off = FallOff::kSlow;
};
inline Eigen::VectorXd dry_friction(const Series& s, const DryFriction& f) {
  const Eigen::ArrayXd ratio2 = (s.motion.v.array() / f.velocity).square();
  const Eigen::ArrayXd share = f.fall_off == FallOff::kSlow
                                   ? Eigen::ArrayXd((1.0 + ratio2).inverse())
                                   : Eigen::ArrayXd((-ratio2).exp());
  return bristle_effort(s.motion.q, (1.0 + f.extra * share).matrix(), 1.0 / f.displacement,
                        s.fresh);
}

inline Eigen::VectorXd centred(const Series& s, const Eigen::VectorXd& x) {
  return (x.array() - s.training_mean(x)).matrix();
}

/// Speed below which the joint counts as at rest: a fiftieth of its usual one.
inline double rest_speed(const Series& s) { return 0.02 * s.training_rms(s.motion.v); }

/// Without its mean and divided by its spread over the training rows.
inline Eigen::VectorXd scaled(const Series& s, const Eigen::VectorXd& x) {
  const Eigen::VectorXd zero_mean = centred(s, x);
  const double rms = s.training_rms(zero_mean);
  return rms > 0.0 ? Eigen::VectorXd(zero_mean / rms) : zero_mean;
}

inline double range_of(const Series& s, const Eigen::VectorXd& x) {
  const auto [least, greatest] = s.training_range(x);
  return greatest - least;
}

/// `count` factors from `from` to `to`, evenly spaced in the logarithm.
inline std::vector<Shape> log_grid(double from, double to, int count) {
  std::vector<Shape> grid;
  for (int i = 0; i < count; ++i) {
    grid.push_back(
        {from * std::pow(to / from, static_cast<double>(i) / static_cast<double>(count - 1))});
  }
  return grid;
}

/// Orders of waves over the joint's position, from so many periods over the range to so many.
inline std::vector<Shape> wave_orders(const Series& s, double least_periods, double most_periods,
                                      int count) {
  const double range = range_of(s, s.motion.q);
  return log_grid(least_periods * core::kRadPerTurn / range,
                  most_periods * core::kRadPerTurn / range, count);
}

inline double middle_of(const Series& s) {
  const auto [least, greatest] = s.training_range(s.motion.q);
  return 0.5 * (least + greatest);
}

/// Sine and cosine of that order over the joint's position, from the middle of the motion: about
/// zero far away a little more order would turn a wave's whole phase.
inline Eigen::MatrixXd wave_columns(const Series& s, const Shape& order) {
  const Eigen::ArrayXd turned = order[0] * (s.motion.q.array() - middle_of(s));
  Eigen::MatrixXd out(s.rows(), 2);
  out.col(0) = turned.sin();
  out.col(1) = turned.cos();
  return out;
}

inline std::vector<FormParameter> wave_parameters(const Series& s, const Shape& order,
                                                  const Eigen::VectorXd& b) {
  const double phase = std::atan2(b[1], b[0]) - order[0] * middle_of(s);
  return {{"amplitude", b.norm(), amplitude_unit(s)},
          {"order", order[0], s.prismatic ? "rad_per_m" : "1"},
          {"phase", std::remainder(phase, 2.0 * std::numbers::pi), "rad"}};
}

/// Motor minus joint with this cable under these loads, the recorded motor motion forced in.
inline Eigen::VectorXd cable_stretch(const Series& s, const Eigen::VectorXd& weight,
                                     const Eigen::VectorXd& inertial, const CableNumbers& cable) {
  return replay_cable({s.t_s, s.motion.q, weight, inertial, s.fresh, s.rest_width()}, cable)
      .stretch;
}
inline Eigen::VectorXd cable_stretch(const Series& s, const Eigen::VectorXd& weight,
                                     const CableNumbers& cable) {
  return cable_stretch(s, weight, s.inertial, cable);
}
inline Eigen::VectorXd cable_stretch(const Series& s, const CableNumbers& cable) {
  return cable_stretch(s, s.weight, cable);
}

/// What a change of the plant's cable does to the joint's position.
inline Eigen::VectorXd cable_change(const Series& s, const CableNumbers& changed) {
  return cable_stretch(s, s.cable) - cable_stretch(s, changed);
}

/// What a change of the plant's cable does to the drive's effort.
inline Eigen::VectorXd cable_tension(const Series& s, const Eigen::VectorXd& weight,
                                     const CableNumbers& cable) {
  const Eigen::VectorXd& wound = s.wound.size() > 0 ? s.wound : s.motion.q;
  return replay_cable({s.t_s, wound, weight, {}, s.fresh, s.rest_width()}, cable).tension;
}
inline Eigen::VectorXd cable_tension(const Series& s, const CableNumbers& cable) {
  return cable_tension(s, s.weight, cable);
}
inline Eigen::VectorXd tension_change(const Series& s, const CableNumbers& changed) {
  return cable_tension(s, changed) - cable_tension(s, s.cable);
}

/// True if a weight that the plant lacks is seen only where it stretches the plant's cable: the
/// drive that carries it was not recorded.
inline bool weighs_by_stretch(const Series& s) {
  return s.stage == Stage::kTransmission && !s.effort_recorded && s.cable.compliance > 0.0;
}

/// Stiffness of strands over that of their cable: what slips before the cable has stretched at all
/// is friction.
inline constexpr double kMostStrands = 40.0;

/// True if the load on the cable is known, so that the cable can be replayed.
inline bool replayed(const Series& s) {
  return s.stage == Stage::kTransmission && s.loads.empty() && s.weight.size() > 0;
}

/// Reversals of the direction of motion among training rows.
int reversals(const Series& s);

/// True if the range was passed often and is long enough for a wave to repeat.
inline bool shows_waves(const Series& s) {
  return reversals(s) >= 4 && range_of(s, s.motion.q) > 100.0 * s.rest_width();
}

}  // namespace ravencal::diagnose
