// SPDX-License-Identifier: Apache-2.0
//
// Signals that several effects share.
#pragma once

#include <Eigen/Core>
#include <string>

#include "diagnose/effect_form.hpp"
#include "diagnose/operators.hpp"

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

inline Eigen::VectorXd centred(const Series& s, const Eigen::VectorXd& x) {
  return (x.array() - s.training_mean(x)).matrix();
}

/// Effort that the motion asks of the drive as far as the plant knows it: no recorded effort in it.
inline Eigen::VectorXd known_effort(const Series& s) {
  Eigen::VectorXd effort = s.inertia * s.motion.a;
  if (s.weight.size() > 0) effort += s.weight;
  return effort;
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

/// Reversals of the direction of motion among training rows.
int reversals(const Series& s);

}  // namespace ravencal::diagnose
