// SPDX-License-Identifier: Apache-2.0
//
// Trained layers to a packed network and back, for tools: what is rounded, and by what it is
// calibrated. Nothing here is real-time.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "model/packed_network.hpp"

namespace ravencal::model {

/// "f32", "bf16" or "int8".
std::string_view name_of(packed::Precision precision);
/// Errors (kUsage): no such precision.
core::Result<packed::Precision> precision_of(std::string_view name);

/// What a layer's inputs were over some rows: int8 is calibrated with it.
struct LayerInputs {
  Eigen::VectorXf mean;  ///< [inputs of the layer], as the layer sees them
  float limit = 1.0F;    ///< largest magnitude to represent; larger ones are clamped
};

/// One entry per layer, over the rows of `features_si` without a lost value. Errors (kData): there
/// is no such row.
core::Result<std::vector<LayerInputs>> measure_layer_inputs(const CalibrationModel& model,
                                                            const FeatureMatrix& features_si);

struct Packing {
  packed::Precision precision = packed::Precision::kFloat32;
  std::vector<LayerInputs> inputs;  ///< kInt8: of measure_layer_inputs; else unused
};

/// The packed layers of `model`. Errors (kData): too many layers or outputs, a value that is not
/// finite or beyond the precision, kInt8 without the inputs of every layer.
core::Result<std::vector<std::byte>> pack_layers(const CalibrationModel& model,
                                                 const Packing& packing);

/// The layers that a kernel runs, in f32. Errors (kData): not a packed network.
core::Result<std::vector<DenseLayer>> unpack_layers(std::span<const std::byte> network);

}  // namespace ravencal::model
