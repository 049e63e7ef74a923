// SPDX-License-Identifier: Apache-2.0
//
// The model of one joint: one trial, or a weighted mean of a few (stacking: Wolpert, 1992; weights
// by greedy selection: Caruana et al., 2004).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "choice/trial.hpp"

namespace ravencal::choice {

/// More members cost time in the control loop and hardly lower the error.
inline constexpr std::size_t kMostMembers = 3;

struct Member {
  std::size_t trial = 0;
  double weight = 1.0;  ///< > 0; those of a combination sum up to 1
};

struct Combination {
  std::vector<Member> members;
  /// [lists with rows], prediction - error of the list's rows, SI: of what was chosen without the
  /// list that judges it.
  std::vector<Eigen::VectorXd> judged;
};

/// The best trial, or a mean of trials where that lowers the squared error by more than the
/// standard error of the difference over the lists. For this comparison trial and weights are
/// chosen without the list that judges them. `trials` must not be empty.
Combination combine(std::span<const Trial> trials);

}  // namespace ravencal::choice
