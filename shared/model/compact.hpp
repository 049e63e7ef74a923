// SPDX-License-Identifier: Apache-2.0
//
// Makes a trained network smaller: L1 and L2 penalties leave inputs that nothing reads and hidden
// units that say nothing or always the same. Fewer weights are fewer bytes per tick. Not real time.
#pragma once

#include <cstddef>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::model {

struct CompactOptions {
  /// Root mean square of the change of an output, as a share of that output's scale (the standard
  /// deviation that it was trained on), over the rows given. 0: remove only what cannot change
  /// anything: inputs and units whose weights are exactly zero, or that are constant by their
  /// weights.
  double budget = 0.0;
};

struct Compacted {
  CalibrationModel model;
  std::vector<std::size_t> kept_inputs;  ///< indices into the old features, ascending
  std::size_t weights_before = 0;
  std::size_t weights_after = 0;
  double output_change =
      0.0;  ///< largest over the outputs, in the budget's measure; 0 without rows
};

/// `features_si` [rows x features] are what the network sees, SI units: the training data. An input
/// or unit is replaced by its mean over the rows, folded into the biases of the next layer. The
/// order is by what the replacement costs (spread of the unit times norm of its outgoing weights);
/// as many go as the budget allows. At least one input and one unit of each hidden layer stay.
/// Fails on a feature matrix of another width, and on a positive budget without rows.
core::Result<Compacted> compact(const CalibrationModel& model, const Eigen::MatrixXd& features_si,
                                const CompactOptions& options);

}  // namespace ravencal::model
