// SPDX-License-Identifier: Apache-2.0
//
// A trained calibration as data: which features, how scaled, which layers, what comes out. Training
// makes it, ONNX and blob files store it, evaluation runs it. The real-time form of the same model
// is model/blob_view.hpp + model/packed_network.hpp; tests compare the kernels with this
// arithmetic, and both use the feature state of model/feature_state.hpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/expected_error.hpp"
#include "model/feature_spec.hpp"
#include "model/kinds.hpp"
#include "model/loop_gains.hpp"
#include "model/motion_range.hpp"
#include "model/origin.hpp"
#include "model/packed_network.hpp"
#include "model/random_seeds.hpp"
#include "model/trust_region.hpp"

namespace ravencal::model {

/// One fully connected layer: y = activation(weights * x + biases).
struct DenseLayer {
  Eigen::MatrixXf weights;  ///< [outputs x inputs]
  Eigen::VectorXf biases;   ///< [outputs]
  Activation activation = Activation::kLinear;
  /// Weights read back from int8: inputs are rounded to multiples of this (32767 at most); else 0.
  float input_step = 0.0F;
  packed::LayerKind kind =
      packed::LayerKind::kDense;  ///< the halves of a GRU: the first two layers
  std::uint8_t window = 0;        ///< kGruRecurrent, as in packed_network.hpp
  std::uint32_t stride_rows = 0;  ///< kGruRecurrent, as in packed_network.hpp
};

/// Standard scaling: scaled = (value - mean) / scale. A constant column has scale 1.
struct Standardiser {
  Eigen::VectorXd mean;   ///< SI units
  Eigen::VectorXd scale;  ///< SI units, > 0
};

/// What one output corrects: corrected = estimate + output.
struct OutputSpec {
  std::string joint;             ///< e.g. "elbow"
  std::string estimate_channel;  ///< the channel that the correction is added to, e.g. "jpos.elbow"
  std::string unit;              ///< SI: "rad" or "m"
};

/// Invariants: features.size() == inputs of the first layer (or of the output, if there is no
/// hidden layer: linear regression is one linear layer); outputs.size() == outputs of the last.
struct CalibrationModel {
  std::vector<FeatureSpec> features;
  Standardiser input;
  Eigen::VectorXd input_min;  ///< trained range, SI units, per feature
  Eigen::VectorXd input_max;
  std::optional<TrustRegion> trust;  ///< of the training rows; without it every row is trusted
  std::vector<DenseLayer> layers;
  Standardiser output;  ///< mean = the bias that "bias removal" removes
  std::vector<OutputSpec> outputs;
  Origin origin;
  std::optional<LoopGains> loop_gains;  ///< none: nobody computed them
  std::vector<ExpectedError> expected;  ///< [outputs]; empty: unknown
  std::optional<MotionRange> motion;    ///< of the training; none: nobody computed it
  std::vector<RandomSeeds> seeds;       ///< of training recordings of the twin; others have none
  double row_period_s = 0.01;           ///< time between training rows: the unit of lagged features
  std::map<std::string, std::string>
      provenance;  ///< version, recordings and hashes, seed, settings

  /// Joint errors to add, SI units, [rows x outputs]; `features_si` is [rows x features], clamped
  /// as the plugin clamps it (scaled_inputs.hpp). Rows are apart: a GRU sees each held over its
  /// whole window.
  [[nodiscard]] Eigen::MatrixXd predict(const Eigen::MatrixXd& features_si) const;
};

}  // namespace ravencal::model
