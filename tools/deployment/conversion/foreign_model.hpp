// SPDX-License-Identifier: Apache-2.0
//
// A network of another program, as its file describes it: a chain of layers in the units of its own
// scaling, and a way to run the file itself, in double and without the chain, so that both can be
// compared.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::conversion {

/// y = gain * x + offset, value by value; both [values], or empty: y = x.
struct Affine {
  Eigen::VectorXd gain;
  Eigen::VectorXd offset;
  /// Trained with the network (batch normalisation), beside which its data may be scaled, too.
  bool is_learned = false;
};

/// Inputs through `input`, the layers, then `output`. A GRU is the first two layers, as in
/// model/packed_network.hpp, with `window` and `stride_rows` still unset.
struct ForeignNetwork {
  Eigen::Index inputs = 0;
  Eigen::Index outputs = 0;
  bool has_gru = false;
  std::uint32_t window = 0;  ///< samples that the GRU looks at; 0: the file does not say
  Affine input;
  std::vector<model::DenseLayer> layers;
  Affine output;
};

/// Samples of a window, oldest first (one if the network has no GRU), each [rows x inputs], in the
/// file's units; the result is [rows x outputs].
using SourceFunction =
    std::function<core::Result<Eigen::MatrixXd>(std::span<const Eigen::MatrixXd>)>;

struct ForeignModel {
  std::string origin;  ///< "Keras 2.15.0", "pytorch 1.13, ONNX opset 13"
  ForeignNetwork network;
  SourceFunction run;
};

/// Oldest and newest opset whose operators are read; between them none of them changes its meaning.
inline constexpr std::int64_t kOldestOpset = 7;
inline constexpr std::int64_t kNewestOpset = 23;

/// An ONNX graph that is one chain of dense layers, scaling, batch normalisation, activations and
/// what passes a flat vector on (FORMATS.md). Errors (kIo, kData) name the node and the remedy.
core::Result<ForeignModel> read_foreign_onnx(const std::string& path);

/// A Keras 2 or 3 model in HDF5 (`model.save("model.h5")`): Dense layers behind at most one GRU,
/// and what is folded into them. Errors (kIo, kData) name the layer and the remedy.
core::Result<ForeignModel> read_keras(const std::string& path);

}  // namespace ravencal::conversion
