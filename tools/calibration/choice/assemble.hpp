// SPDX-License-Identifier: Apache-2.0
//
// The chosen models of all joints as one network, which is stored, converted and run as any other.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "choice/basis.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::choice {

/// A fitted basis of one output: prediction, SI = readout . design row.
struct Part {
  Eigen::Index output = 0;
  Basis basis;              ///< columns are those of the network's inputs
  Eigen::VectorXd readout;  ///< [Basis::size()], SI, times the weight of its member
};

/// Layers over `inputs` scaled inputs. Without units: one linear layer. With units: one hidden
/// layer of tanh and a linear output. There, the linear part of an output is one unit near zero,
/// where tanh is straight: over the training its argument has the standard deviation kStraight, so
/// that it bends by 2e-5 of the value at four standard deviations, and single precision resolves it
/// to 8e-5 of one. `scaled` are training rows [rows x inputs]; `output` scales the result.
std::vector<model::DenseLayer> layers_of(std::span<const Part> parts, const Eigen::MatrixXd& scaled,
                                         const model::Standardiser& output);

inline constexpr double kStraight = 1.0 / 256.0;

}  // namespace ravencal::choice
