// SPDX-License-Identifier: Apache-2.0
//
// What a step ought to give, and how far from it a peer may be.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "model/calibration_model.hpp"

namespace ravencal::bench {

/// Outputs of the network, unscaled, in double precision.
struct Reference {
  std::vector<double> outputs;
  std::vector<double> bound;  ///< of the error of each output; empty for peers that promise none
};

/// Of the weights as they are stored: bf16 and int8 round them, which is no error of a step. The
/// bound is model::kernel_promise's: sums and scaling in f32, activations, and inputs of int8
/// layers that lie so near the middle between two units that they may round either way.
/// `features_si` lie within the range to which the plugin clamps.
Reference stored_reference(const model::CalibrationModel& stored,
                           const Eigen::VectorXf& features_si);

/// The same for a network whose inputs and outputs are not scaled.
Reference stored_reference(std::span<const std::byte> packed_network,
                           const std::vector<float>& inputs);

/// Of the output that is worst in proportion to its bound, or farthest off where there is none.
struct Deviation {
  double error = 0.0;
  std::optional<double> bound;

  /// Also for an output that is no number.
  [[nodiscard]] bool is_beyond_bound() const { return bound && !(error <= *bound); }
};
Deviation deviation(const Reference& reference, std::span<const float> outputs);

}  // namespace ravencal::bench
