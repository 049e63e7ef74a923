// SPDX-License-Identifier: Apache-2.0
//
// Forward and backward pass of a recurrent network over a window, behind raw pointers, so that
// recurrent_kernels_*.cpp can compile them for one instruction set each
// (tools/calibration/learn/kernels.hpp says why). Matrices are column-major, one sample per column.
// Any thread.
#pragma once

#include <cstddef>

#include "learn/isa.hpp"

namespace ravencal::methods {

enum class Cell {
  /// Gates in the order update, reset, candidate; the reset gate acts behind the recurrent product:
  /// what Keras calls reset_after, and what the plugin runs (shared/model/packed_network.hpp).
  kGru,
  kLstm  ///< gates in the order input, forget, output, candidate
};

/// A cell over `window` samples from a state of zero, then a sigmoid layer if dense > 0, then a
/// linear layer. Parameters lie one after the other, each block on a line of 64 bytes of floats, so
/// that sums run in the same order wherever the memory lies: input weights [gates x inputs], input
/// biases, recurrent weights [gates x units], recurrent biases, dense weights and biases, output
/// weights and biases, where gates = 3 or 4 times units.
struct RecurrentShape {
  Cell cell = Cell::kGru;
  std::ptrdiff_t inputs = 0;
  std::ptrdiff_t units = 0;
  std::ptrdiff_t dense = 0;
  std::ptrdiff_t outputs = 0;
  std::ptrdiff_t window = 0;

  [[nodiscard]] std::ptrdiff_t gates() const { return (cell == Cell::kGru ? 3 : 4) * units; }
  [[nodiscard]] std::ptrdiff_t head_inputs() const { return dense > 0 ? dense : units; }
  static constexpr int kBlocks = 8;
  /// Scalars of a parameter block, in the order above.
  [[nodiscard]] std::ptrdiff_t size(int block) const {
    const std::ptrdiff_t sizes[kBlocks] = {
        gates() * inputs, gates(), gates() * units,         gates(),
        dense * units,    dense,   outputs * head_inputs(), outputs};
    return sizes[block];
  }
  [[nodiscard]] std::ptrdiff_t offset(int block) const {
    constexpr std::ptrdiff_t kLine = 16;
    std::ptrdiff_t at = 0;
    for (int i = 0; i < block; ++i) at += (size(i) + kLine - 1) / kLine * kLine;
    return at;
  }
  /// Padding included.
  [[nodiscard]] std::ptrdiff_t parameter_count() const { return offset(kBlocks); }
};

template <typename Scalar>
struct RecurrentKernels {
  /// All memory on lines of 64 bytes.
  /// `inputs` [inputs x (window * samples)]: all samples of the oldest step first. `outputs`
  /// [outputs x samples].
  void (*forward)(const RecurrentShape& shape, const Scalar* parameters, const Scalar* inputs,
                  std::ptrdiff_t samples, Scalar* outputs);
  /// Mean squared error against `targets` [outputs x samples]; overwrites `gradient` but its
  /// padding.
  double (*gradient)(const RecurrentShape& shape, const Scalar* parameters, const Scalar* inputs,
                     const Scalar* targets, std::ptrdiff_t samples, Scalar* gradient);
};

const RecurrentKernels<float>& recurrent_kernels(learn::Isa isa);
/// For checks: baseline only.
const RecurrentKernels<double>& recurrent_double_kernels();

}  // namespace ravencal::methods
