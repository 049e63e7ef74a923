// SPDX-License-Identifier: Apache-2.0
//
// How much of a residual differs between two passes in the same circumstances. That is noise,
// whatever physics the model lacks; what is left above it is physics, whatever its name.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace ravencal::diagnose {

/// Rows of a residual. The rows of one pass follow each other and share their slow noise.
struct Passes {
  Eigen::MatrixXd circumstances;  ///< [quantities x rows], each over its own deviation
  Eigen::VectorXd residual;       ///< [rows]
  std::vector<int> pass;          ///< of each row, rising from 0
};

/// Mean squares over the rows that were compared.
struct Repetition {
  double left = 0.0;              ///< of the residual
  double differs = 0.0;           ///< of what two passes do not share: no less than the noise
  double excess_deviation = 0.0;  ///< one standard error of left - per_floor * differs
  double agreement = 0.0;         ///< share of the circumstances' variance that compared rows share
  std::size_t rows = 0, passes = 0;
};

/// Compares rows with the row of another pass that is nearest in circumstances. Half of their mean
/// squared difference is the noise and what the rest of the distance adds (difference-based
/// variance by the nearest neighbour: Liitiäinen, Corona, Lendasse, Neural Processing Letters
/// 2008). None where nothing can be compared.
std::optional<Repetition> repetition_of(const Passes& passes, double per_floor);

}  // namespace ravencal::diagnose
