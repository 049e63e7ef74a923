// SPDX-License-Identifier: Apache-2.0
//
// The mean of several fits, as one fit of fewer units: the control loop pays for one network,
// however many draws decided what it says.
#pragma once

#include <Eigen/Core>
#include <span>

#include "choice/basis.hpp"

namespace ravencal::choice {

/// A basis and its readout, [Basis::size()], SI.
struct Fit {
  Basis basis;
  Eigen::VectorXd readout;
};

/// The mean of `fits`, which have equal columns, over units chosen among theirs (orthogonal
/// matching pursuit), with a readout fitted anew. Matched at `scaled` [rows x offered inputs] and
/// at points twice as far from the middle of every input's range, where the plugin clamps its
/// inputs (model/input_limits.hpp). The constant is that of the mean.
Fit condensed(std::span<const Fit> fits, Eigen::Index units, const Eigen::MatrixXd& scaled);

}  // namespace ravencal::choice
