// SPDX-License-Identifier: Apache-2.0
//
// Makes a trained network smaller: removes inputs and units that change nothing, and within a
// budget those that others can replace. Fewer weights are fewer bytes per tick. Not real time.
#pragma once

#include <cstddef>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::model {

struct CompactOptions {
  /// Root mean square of the change of an output, as a share of that output's scale (the standard
  /// deviation that it was trained on), over the rows given. 0: remove only what cannot change
  /// anything: inputs that never changed in training (the plugin clamps them to what they were),
  /// and inputs and units whose weights are exactly zero.
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

/// `features_si` [rows x features] are what the network sees, SI units: the training data. A
/// constant goes into the biases of the next layer. Within a budget every layer keeps the fewest
/// inputs that reproduce its sums, and its weights are fitted anew (unit_reduction.hpp); all layers
/// give up equally much of the outputs. At least one input and one unit of each hidden layer stay.
/// The trust region becomes that of the inputs that stay; its distances are measured anew on the
/// rows, if there are any. Fails on a feature matrix of another width, and on a positive budget
/// without rows.
core::Result<Compacted> compact(const CalibrationModel& model, const FeatureMatrix& features_si,
                                const CompactOptions& options);

}  // namespace ravencal::model
