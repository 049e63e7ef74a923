// SPDX-License-Identifier: Apache-2.0
//
// A learner without physics that says what is still predictable: gradient-boosted trees on
// histogram bins, fitted to five folds and asked about the sixth. Deterministic.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnose/fit/blocks.hpp"

namespace ravencal::diagnose {

struct HeldOutPrediction {
  Eigen::VectorXd value;           ///< [training rows], each from trees that did not see its fold
  std::vector<double> importance;  ///< per feature, share of the squared error that its splits took
};

/// `features` [training rows x f], `target` [training rows].
HeldOutPrediction boosted_held_out(const Blocks& blocks, const Eigen::MatrixXd& features,
                                   const Eigen::VectorXd& target);

}  // namespace ravencal::diagnose
