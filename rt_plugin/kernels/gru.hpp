// SPDX-License-Identifier: Apache-2.0
//
// One tick of a GRU: all windows under way advance by the tick's sample (forward.hpp,
// memory_bytes). For forward_unit.cpp only.
#pragma once

#include "kernels/forward.hpp"
#include "kernels/gru_memory.hpp"
#include "kernels/vector.hpp"

namespace ravencal::kernels {
namespace {

/// Columns of the recurrent product. Fewer windows leave some unused: they cost time, always the
/// same.
constexpr std::size_t kColumns = kMaxWindow - 1;

/// Vectors of outputs whose sums fit into the registers, times kColumns.
constexpr std::size_t kGruVectors = kVectorBytes == 64 ? 2 : 1;

/// Weight `j` of the kGroup that lie in a 32-bit lane (packed_network.hpp), in units of its row.
template <std::size_t kGroup>
RAVENCAL_INLINE Floats weight_in(const Words& lane, std::size_t j) noexcept {
  if constexpr (kGroup == 1) {
    return same_bits<Floats>(lane);
  } else if constexpr (kGroup == 2) {
    return same_bits<Floats>(j == 0 ? lane << 16U : lane & 0xFFFF0000U);
  } else {
    const Words upper = lane << static_cast<std::uint32_t>(24 - 8 * j);
    return __builtin_convertvector(same_bits<Ints>(upper) >> 24, Floats);
  }
}

/// products[c] = weights * states[c] + biases, for every column c.
template <std::size_t kGroup>
[[gnu::noinline]] void recurrent_products(const PackedView& network, const PackedLayer& layer,
                                          const float* const* states,
                                          float* const* products) noexcept {
  const std::byte* const base = network.base;
  const std::size_t inputs = padded(layer.inputs, kGroup);
  const auto* const biases = reinterpret_cast<const float*>(base + layer.biases_at);
  const auto* const scales = reinterpret_cast<const float*>(base + layer.row_scales_at);
  const Floats per_step = broadcast(kGroup == 4 ? 1.0F / layer.input_step : 1.0F);
  for (std::size_t first = 0; first < layer.outputs; first += kPanelLanes) {
    const std::size_t rest = layer.outputs - first;
    const std::size_t lanes = rest < kPanelLanes ? rest : kPanelLanes;
    const auto* const panel =
        reinterpret_cast<const std::uint32_t*>(base + layer.weights_at) + first * (inputs / kGroup);
    for (std::size_t lane = 0; lane < lanes; lane += kGruVectors * kWidth) {
      Floats sums[kColumns][kGruVectors] = {};
      const std::uint32_t* w = panel + lane;
      for (std::size_t i = 0; i < inputs; i += kGroup, w += lanes) {
        Words words[kGruVectors];
        for (std::size_t v = 0; v < kGruVectors; ++v) {
          __builtin_prefetch(reinterpret_cast<const std::byte*>(w + v * kWidth) + 8192);
          words[v] = load<Words>(w + v * kWidth);
        }
        for (std::size_t j = 0; j < kGroup; ++j) {
          for (std::size_t v = 0; v < kGruVectors; ++v) {
            const Floats weight = weight_in<kGroup>(words[v], j);
            for (std::size_t c = 0; c < kColumns; ++c) {
              sums[c][v] += weight * broadcast(states[c][i + j]);
            }
          }
        }
      }
      for (std::size_t v = 0; v < kGruVectors; ++v) {
        const std::size_t at = first + lane + v * kWidth;
        const Floats unit = kGroup == 4 ? load<Floats>(scales + at) * per_step : per_step;
        const Floats bias = load<Floats>(biases + at);
        for (std::size_t c = 0; c < kColumns; ++c) {
          store(products[c] + at, sums[c][v] * unit + bias);
        }
      }
    }
  }
}

/// after = update * before + (1 - update) * tanh(x_candidate + reset * h_candidate); `after` may be
/// `before`. `x`: the projected inputs; `h`: the recurrent products; three blocks each.
RAVENCAL_INLINE void advance_state(std::size_t units, const float* x, const float* h,
                                   const float* before, float* after) noexcept {
  for (std::size_t i = 0; i < units; i += kWidth) {
    const Floats update = sigmoid(load<Floats>(x + i) + load<Floats>(h + i));
    const Floats reset = sigmoid(load<Floats>(x + units + i) + load<Floats>(h + units + i));
    const Floats candidate = hyperbolic_tangent(load<Floats>(x + 2 * units + i) +
                                                reset * load<Floats>(h + 2 * units + i));
    const Floats kept = before == nullptr ? Floats{} : load<Floats>(before + i);
    store(after + i, candidate + update * (kept - candidate));
  }
}

/// `x`: the inputs' projection; `y` [padded units]: the state behind the whole window.
[[gnu::noinline]] void run_gru(const PackedView& network, const PackedLayer& layer, const float* x,
                               float* y, std::byte* memory_bytes) noexcept {
  auto* const memory = reinterpret_cast<GruMemory*>(memory_bytes);
  const std::size_t units = padded(layer.inputs, kLineLanes);
  const std::size_t columns = layer.window - std::size_t{1};
  auto* const product_memory = reinterpret_cast<float*>(memory + 1);
  float* const slot = product_memory + columns * layer.outputs + memory->phase * columns * units;
  const float* states[kColumns];
  float* products[kColumns];
  for (std::size_t c = 0; c < kColumns; ++c) {  // unused columns repeat the first
    states[c] = slot + (c < columns ? c : 0) * units;
    products[c] = product_memory + (c < columns ? c : 0) * layer.outputs;
  }
  if (layer.precision == Precision::kFloat32) {
    recurrent_products<1>(network, layer, states, products);
  } else if (layer.precision == Precision::kBfloat16) {
    recurrent_products<2>(network, layer, states, products);
  } else {
    recurrent_products<4>(network, layer, states, products);
  }
  // From the oldest window to the newest, so that each state is read before it is replaced.
  advance_state(units, x, products[columns - 1], states[columns - 1], y);
  for (std::size_t c = columns - 1; c > 0; --c) {
    advance_state(units, x, products[c - 1], states[c - 1], slot + c * units);
  }
  const auto* const biases = reinterpret_cast<const float*>(network.base + layer.biases_at);
  advance_state(units, x, biases, nullptr, slot);
  memory->phase = memory->phase + 1 < memory->phases ? memory->phase + 1 : 0;
}

}  // namespace
}  // namespace ravencal::kernels
