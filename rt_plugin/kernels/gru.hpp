// SPDX-License-Identifier: Apache-2.0
//
// One tick of a GRU: all windows under way advance by the tick's sample (forward.hpp,
// memory_bytes). For forward_unit.cpp only.
#pragma once

#include "kernels/forward.hpp"
#include "kernels/gru_memory.hpp"
#include "kernels/lanes.hpp"
#include "kernels/panel.hpp"
#include "kernels/vector.hpp"

namespace ravencal::kernels {
namespace {

/// Columns of the recurrent product. Fewer windows leave some unused: they cost time, always the
/// same.
constexpr std::size_t kColumns = kMaxWindow - 1;

/// Lanes whose sums fit into the registers, times kColumns.
constexpr int kGruLanes = lanes_of(kVectorBytes == 64 ? 2 : 1);

/// weights * state + biases, for the state of every column; kGroup weights lie side by side.
template <std::size_t kGroup>
struct RecurrentKernel {
  const float* states[kColumns];
  std::size_t products_at[kColumns];  ///< where a column's products begin, in floats
  float input_step;                   ///< kInt8: what the rows' units are divided by

  template <int kLanes>
  RAVENCAL_INLINE static Lanes<kLanes> weights(const std::uint32_t* w, std::size_t j) noexcept {
    if constexpr (kGroup == 1) {
      return From<kLanes>(reinterpret_cast<const float*>(w));
    } else {
      Lanes<kLanes> all;
      for (int v = 0; v < kLanes; v += kWidth) {
        store(all.data() + v, weight_in<kGroup>(load<Words>(w + v), j));
      }
      return all;
    }
  }

  template <int kLanes>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    Lanes<kLanes> sums[kColumns];
    for (Lanes<kLanes>& sum : sums) sum.setZero();
    const auto* w = reinterpret_cast<const std::uint32_t*>(panel.weights) + lane;
    for (std::size_t i = 0; i < panel.inputs; i += kGroup, w += panel.lanes) {
      fetch_ahead<4 * kLanes>(w);
      for (std::size_t j = 0; j < kGroup; ++j) {
        const Lanes<kLanes> weight = weights<kLanes>(w, j);
        for (std::size_t c = 0; c < kColumns; ++c) sums[c] += weight * states[c][i + j];
      }
    }
    const From<kLanes> biases(panel.biases + lane);
    const From<kLanes> scales(panel.row_scales + lane);
    for (std::size_t c = 0; c < kColumns; ++c) {
      if constexpr (kGroup == 4) sums[c] *= scales * (1.0F / input_step);
      To<kLanes>(panel.y + products_at[c] + lane) = sums[c] + biases;
    }
  }
};

/// after = update * before + (1 - update) * tanh(x_candidate + reset * h_candidate); `after` may be
/// `before`. `x`: the projected inputs; `h`: the recurrent products; three blocks each.
RAVENCAL_INLINE void advance_state(std::size_t units, const float* x, const float* h,
                                   const float* before, float* after) noexcept {
  const auto line = [](const float* at) { return From<kLine>(at); };
  for (std::size_t i = 0; i < units; i += kLine, x += kLine, h += kLine) {
    const Line update = sigmoid(line(x) + line(h));
    const Line reset = sigmoid(line(x + units) + line(h + units));
    const Line candidate = hyperbolic_tangent(line(x + 2 * units) + reset * line(h + 2 * units));
    const Line kept = before == nullptr ? Line::Zero() : Line(line(before + i));
    To<kLine>(after + i) = candidate + update * (kept - candidate);
  }
}

/// `x`: the inputs' projection; `y` [padded units]: the state behind the whole window.
[[gnu::noinline]] void run_gru(const PackedView& network, const PackedLayer& layer, const float* x,
                               float* y, std::byte* memory_bytes) noexcept {
  auto* const memory = reinterpret_cast<GruMemory*>(memory_bytes);
  const std::size_t units = padded(layer.inputs, kLineLanes);
  const std::size_t columns = layer.window - std::size_t{1};
  auto* const products = reinterpret_cast<float*>(memory + 1);
  float* const slot = products + columns * layer.outputs + memory->phase * columns * units;
  const auto multiply = [&]<std::size_t kGroup>(RecurrentKernel<kGroup> kernel) {
    for (std::size_t c = 0; c < kColumns; ++c) {  // unused columns repeat the first
      kernel.states[c] = slot + (c < columns ? c : 0) * units;
      kernel.products_at[c] = (c < columns ? c : 0) * layer.outputs;
    }
    kernel.input_step = layer.input_step;
    run_panels<kGruLanes>(network, layer, kernel, products);
  };
  if (layer.precision == Precision::kFloat32) {
    multiply(RecurrentKernel<1>{});
  } else if (layer.precision == Precision::kBfloat16) {
    multiply(RecurrentKernel<2>{});
  } else {
    multiply(RecurrentKernel<4>{});
  }
  // From the oldest window to the newest, so that each state is read before it is replaced.
  const auto products_of = [&](std::size_t c) { return products + c * layer.outputs; };
  advance_state(units, x, products_of(columns - 1), slot + (columns - 1) * units, y);
  for (std::size_t c = columns - 1; c > 0; --c) {
    advance_state(units, x, products_of(c - 1), slot + (c - 1) * units, slot + c * units);
  }
  const auto* const biases = reinterpret_cast<const float*>(network.base + layer.biases_at);
  advance_state(units, x, biases, nullptr, slot);
  memory->phase = memory->phase + 1 < memory->phases ? memory->phase + 1 : 0;
}

}  // namespace
}  // namespace ravencal::kernels
