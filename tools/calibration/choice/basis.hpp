// SPDX-License-Identifier: Apache-2.0
//
// The functions of the inputs that a linear readout adds up: the inputs themselves, and units
// tanh(w z + b) with weights drawn at random (random features: Rahimi and Recht, 2007; extreme
// learning machine: Huang et al., 2006). The readout is found in one linear solve, so that a
// setting is tried in a second, and the sum is an ordinary network of one hidden layer.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "model/calibration_model.hpp"

namespace ravencal::choice {

/// Which inputs and which units.
struct BasisSpec {
  std::vector<Eigen::Index> columns;  ///< of the offered inputs
  Eigen::Index units = 0;             ///< 0: linear
  double steepness = 0.0;  ///< standard deviation of a unit's weighted sum over scaled inputs
  std::uint64_t seed = 1;
  int draws = 1;  ///< the mean of so many fits, each on units of its own
};

/// A drawn basis. A design row is [units, scaled inputs, 1].
struct Basis {
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd weights;  ///< [units x columns], on scaled inputs
  Eigen::VectorXd biases;   ///< [units]

  [[nodiscard]] Eigen::Index size() const {
    return weights.rows() + static_cast<Eigen::Index>(columns.size()) + 1;
  }
  /// [rows x size()] of `scaled` [rows x offered inputs].
  [[nodiscard]] Eigen::MatrixXd design(const Eigen::MatrixXd& scaled) const;
};

/// The `which`th of spec.draws, from 0. The same spec draws the same basis.
Basis draw(const BasisSpec& spec, int which = 0);

}  // namespace ravencal::choice
