// SPDX-License-Identifier: Apache-2.0
//
// The inner loops of training, behind raw pointers. kernels.inc holds them once as templates; the
// kernels_*.cpp compile them for one instruction set each, with the Eigen namespace renamed, so
// that the linker cannot merge an AVX-512 copy of an inline function into code for any x86-64.
// Matrices are column-major with one sample per column; networks are flat arrays laid out by
// Shape (shape.hpp). No allocation beyond Eigen's packing buffers, no shared state: any thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "learn/isa.hpp"
#include "model/kinds.hpp"

namespace ravencal::learn {

/// One layer inside the flat parameter array.
struct LayerShape {
  std::ptrdiff_t inputs = 0;
  std::ptrdiff_t outputs = 0;
  model::Activation activation = model::Activation::kLinear;
  std::ptrdiff_t weights = 0;  ///< offset of [outputs x inputs], a multiple of 64 bytes
  std::ptrdiff_t biases = 0;   ///< offset of [outputs], a multiple of 64 bytes
};

/// Some samples of a batch, and what to do with them.
template <typename Scalar>
struct Tile {
  const LayerShape* layers = nullptr;
  std::ptrdiff_t layer_count = 0;
  const Scalar* parameters = nullptr;
  const Scalar* inputs = nullptr;   ///< [inputs of the first layer x samples]
  const Scalar* targets = nullptr;  ///< [outputs of the last layer x samples]
  std::ptrdiff_t samples = 0;
  Scalar* workspace = nullptr;  ///< Shape::workspace_size(samples)
  Scalar error_weight = 0;      ///< d loss / d (squared error of one output)
  Scalar activity_weight = 0;   ///< d loss / d (square of one hidden activation)
};

struct TileLoss {
  double squared_error = 0.0;     ///< sum over samples and outputs
  double squared_activity = 0.0;  ///< sum over samples and hidden activations
};

/// A stretch of parameters with the same penalties, its gradients from each tile, and its moments.
template <typename Scalar>
struct UpdateRange {
  std::ptrdiff_t begin = 0;
  std::ptrdiff_t end = 0;
  Scalar l1 = 0;
  Scalar l2 = 0;
  const Scalar* const* tile_gradients = nullptr;  ///< summed in this order
  std::ptrdiff_t tile_count = 0;
};

/// Adam as Keras writes it: p -= step_size * m / (sqrt(v) + epsilon), where step_size holds the
/// bias corrections (Kingma and Ba 2015, end of section 2).
template <typename Scalar>
struct AdamStep {
  Scalar step_size = 0;
  Scalar beta1 = 0;
  Scalar beta2 = 0;
  Scalar epsilon = 0;
};

template <typename Scalar>
struct Kernels {
  /// Forward and backward through one tile; overwrites `gradient` (whole parameter array).
  TileLoss (*gradient)(const Tile<Scalar>& tile, Scalar* gradient);
  /// Forward only; the outputs [outputs x samples] are written to `outputs`.
  void (*forward)(const Tile<Scalar>& tile, Scalar* outputs);
  /// Sum of the tile gradients plus that of the penalties, into total[begin, end).
  void (*total_gradient)(const UpdateRange<Scalar>& range, const Scalar* parameters, Scalar* total);
  /// The same, and one Adam step of parameters[begin, end) and its moments.
  void (*adam)(const UpdateRange<Scalar>& range, const AdamStep<Scalar>& step, Scalar* parameters,
               Scalar* first_moment, Scalar* second_moment);
};

/// Float kernels for a supported instruction set.
const Kernels<float>& float_kernels(Isa isa);

/// Double kernels, for checks: baseline only.
const Kernels<double>& double_kernels();

}  // namespace ravencal::learn
