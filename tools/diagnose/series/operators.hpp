// SPDX-License-Identifier: Apache-2.0
//
// Operators with memory that turn a motion into the shape of an effect. All act on a whole series
// in order of time and start afresh where `fresh[i]` is set (a new recording or episode).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "physics/effects/slip_element.hpp"

namespace ravencal::diagnose {

/// Elastic-slip element over `width`, normalised to [-1, 1]: -1 or 1 while the motion goes on, in
/// between for `width` after a reversal (x and width in the same unit, width > 0). It is the
/// direction of motion with a memory at rest, Dahl's presliding, and one play of half-width
/// width / 2 in one.
inline Eigen::VectorXd direction_memory(const Eigen::VectorXd& x, double width,
                                        const std::vector<char>& fresh) {
  Eigen::VectorXd state(x.size());
  double s = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (i == 0 || fresh[static_cast<std::size_t>(i)] != 0) {
      s = 0.0;
    } else {
      s = physics::slipped(s, 2.0 * (x[i] - x[i - 1]) / width);
    }
    state[i] = s;
  }
  return state;
}

/// Effort of bristles that the motion x bends and that slip at `level`, which may change from row
/// to row: stiffness (dx - |dx| F / level), exact over steps of even motion (Canudas de Wit et al.,
/// IEEE TAC 1995, without damping of the bristles). Levels and stiffness > 0.
inline Eigen::VectorXd bristle_effort(const Eigen::VectorXd& x, const Eigen::VectorXd& level,
                                      double stiffness, const std::vector<char>& fresh) {
  Eigen::VectorXd out(x.size());
  double effort = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (i == 0 || fresh[static_cast<std::size_t>(i)] != 0) {
      effort = 0.0;
    } else {
      const double moved = x[i] - x[i - 1];
      const double slipping = std::copysign(level[i], moved);
      effort = slipping + (effort - slipping) * std::exp(-stiffness * std::abs(moved) / level[i]);
    }
    out[i] = effort;
  }
  return out;
}

/// The same at a level of one, fully bent after `displacement`: the direction of motion as Dahl's
/// friction knows it.
inline Eigen::VectorXd bristle_side(const Eigen::VectorXd& x, double displacement,
                                    const std::vector<char>& fresh) {
  return bristle_effort(x, Eigen::VectorXd::Ones(x.size()), 1.0 / displacement, fresh);
}

/// Change of x over the last two rows per second, as controllers difference a position.
inline Eigen::VectorXd backward_rate(const Eigen::VectorXd& t_s, const Eigen::VectorXd& x,
                                     const std::vector<char>& fresh) {
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(x.size());
  for (Eigen::Index i = 2; i < x.size(); ++i) {
    const double dt_s = t_s[i] - t_s[i - 2];
    if (fresh[static_cast<std::size_t>(i)] == 0 && dt_s > 0.0) rate[i] = (x[i] - x[i - 2]) / dt_s;
  }
  return rate;
}

/// First-order lag of x with time constant `time_s`; starts at x.
inline Eigen::VectorXd low_pass(const Eigen::VectorXd& x, const Eigen::VectorXd& t_s, double time_s,
                                const std::vector<char>& fresh) {
  Eigen::VectorXd out(x.size());
  double state = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (i == 0 || fresh[static_cast<std::size_t>(i)] != 0) {
      state = x[i];
    } else {
      state += (1.0 - std::exp(-(t_s[i] - t_s[i - 1]) / time_s)) * (x[i] - state);
    }
    out[i] = state;
  }
  return out;
}

}  // namespace ravencal::diagnose
