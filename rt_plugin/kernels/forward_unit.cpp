// SPDX-License-Identifier: Apache-2.0
//
// The forward pass for one instruction set. CMake compiles this file once per set, with that set's
// flags, a name for Eigen's namespace and RAVENCAL_FORWARD, the function to define.
#include "kernels/forward.hpp"
#include "kernels/gru.hpp"
#include "kernels/int8_dot.hpp"
#include "kernels/lanes.hpp"
#include "kernels/panel.hpp"
#include "kernels/vector.hpp"

namespace ravencal::kernels {
namespace {

/// A network of fewer bytes soon comes from the first caches, where asking ahead costs a fifth.
constexpr std::size_t kNearBytes = 262144;

/// kLanes sums from lane `lane` on, f32 weights. Several sums run side by side where there are few
/// lanes, to hide the latency of the multiplication. kFar: the network is so large that it is worth
/// asking ahead.
template <bool kFar>
struct Float32Kernel {
  const float* x;

  template <int kLanes>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    constexpr std::size_t kChains = kAccumulators * kWidth / kLanes;
    Lanes<kLanes> sums[kChains];
    sums[0] = From<kLanes>(panel.biases + lane);
    for (std::size_t c = 1; c < kChains; ++c) sums[c].setZero();
    const float* w = reinterpret_cast<const float*>(panel.weights) + lane;
    std::size_t i = 0;
    for (; i + kChains <= panel.inputs; i += kChains) {
      for (std::size_t c = 0; c < kChains; ++c, w += panel.lanes) {
        if constexpr (kFar) fetch_ahead<4 * kLanes>(w);
        sums[c] += From<kLanes>(w) * x[i + c];
      }
    }
    for (; i < panel.inputs; ++i, w += panel.lanes) sums[0] += From<kLanes>(w) * x[i];
    for (std::size_t c = 1; c < kChains; ++c) sums[0] += sums[c];
    To<kLanes>(panel.y + lane) = sums[0];
  }
};

struct Bfloat16Kernel {
  const float* x;  ///< finite behind the last input, where the weights are zero

  template <int kLanes>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    constexpr int kVectors = kLanes / kWidth;
    constexpr int kChains = kVectors <= kAccumulators / 2 ? 2 : 1;
    Floats sums[kChains][kVectors] = {};
    for (int v = 0; v < kVectors; ++v) {
      sums[0][v] = load<Floats>(panel.biases + lane + v * kWidth);
    }
    const auto* w = reinterpret_cast<const std::uint32_t*>(panel.weights) + lane;
    for (std::size_t i = 0; i < panel.inputs; i += 2, w += panel.lanes) {
      fetch_ahead<4 * kLanes>(w);
      for (int v = 0; v < kVectors; ++v) {
        const Words pair = load<Words>(w + v * kWidth);
        sums[0][v] += weight_in<2>(pair, 0) * broadcast(x[i]);
        sums[kChains - 1][v] += weight_in<2>(pair, 1) * broadcast(x[i + 1]);
      }
    }
    for (int v = 0; v < kVectors; ++v) {
      Floats total = sums[0][v];
      if constexpr (kChains == 2) total += sums[1][v];
      store(panel.y + lane + v * kWidth, total);
    }
  }
};

struct Int8Kernel {
  QuantisedInputs x;

  template <int kLanes>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    constexpr int kVectors = kLanes / kWidth;
    Int8Dot dots[kVectors];
    const auto* w = reinterpret_cast<const std::int8_t*>(panel.weights) + 4 * lane;
    for (std::size_t i = 0; i < panel.inputs; i += 4, w += 4 * panel.lanes) {
      fetch_ahead<4 * kLanes>(w);
      const Int8Dot::Four four = Int8Dot::spread(x, i);
      for (int v = 0; v < kVectors; ++v) dots[v].add(w + v * kVectorBytes, four);
    }
    for (int v = 0; v < kVectors; ++v) {
      const std::size_t at = lane + static_cast<std::size_t>(v * kWidth);
      const Floats sum = __builtin_convertvector(dots[v].sum(panel.row_sums + at), Floats);
      store(panel.y + at, sum * load<Floats>(panel.row_scales + at) +
                              (load<Floats>(panel.biases + at) + broadcast(x.poison)));
    }
  }
};

/// Adding it moves the nearest integer of |x| < 2^22 into the lowest bits.
constexpr float kRounder = 12582912.0F;  // 1.5 * 2^23

/// Quantises `count` (whole lines) floats into what `to` points at.
[[gnu::noinline]] void quantise(const float* x, std::size_t count, float step,
                                QuantisedInputs& to) noexcept {
  const Floats rounder = broadcast(kRounder);
  Ints any_nan{};
  for (std::size_t i = 0; i < count; i += kWidth) {
    const From<kWidth> inputs(x + i);
    const Lanes<kWidth> units = (inputs * (1.0F / step)).max(-32767.0F).min(32767.0F);
    const Floats input = load<Floats>(x + i);
    any_nan |= input != input;
    const Ints q = same_bits<Ints>(load<Floats>(units.data()) + rounder) - same_bits<Ints>(rounder);
    if constexpr (Int8Dot::kTakesBytes) {
      store(to.high + i, __builtin_convertvector(((q >> 8) + 128) & 255, Bytes));
      store(to.low + i, __builtin_convertvector(q & 255, Bytes));
    } else {
      store(to.value + i, __builtin_convertvector(q, Shorts));
    }
  }
  std::int32_t mask = 0;
  for (std::size_t i = 0; i < kWidth; ++i) mask |= any_nan[i];
  const std::uint32_t bits = static_cast<std::uint32_t>(mask) & 0x7FC00000U;
  std::memcpy(&to.poison, &bits, sizeof(to.poison));
}

/// NaN if one of the inputs is NaN, else 0.
float nan_or_zero(const float* inputs, std::size_t count) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < count; ++i) any |= inputs[i] != inputs[i];
  return any ? __builtin_nanf("") : 0.0F;
}

/// x = inputs, or zero where they are not wanted: in the same instructions, and without a product,
/// which a NaN would survive.
RAVENCAL_INLINE void take_inputs(const float* inputs, std::size_t count, bool wanted,
                                 float* __restrict x) noexcept {
  const std::uint32_t mask = wanted ? 0xFFFFFFFFU : 0U;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, inputs + i, sizeof bits);
    bits &= mask;
    std::memcpy(x + i, &bits, sizeof bits);
  }
}

/// The sums of a layer of few outputs: one f32 row each.
[[gnu::noinline]] void run_rows(const PackedView& network, const PackedLayer& layer, const float* x,
                                float* y) noexcept {
  const std::size_t row = padded(layer.inputs, kLineLanes);
  const auto* w = reinterpret_cast<const float*>(network.base + layer.weights_at);
  To<kLine> sums(y);
  sums = From<kLine>(reinterpret_cast<const float*>(network.base + layer.biases_at));
  for (std::size_t o = 0; o < layer.outputs; ++o, w += row) {
    Line products = Line::Zero();
    for (std::size_t i = 0; i < row; i += kLine)
      products += From<kLine>(w + i) * From<kLine>(x + i);
    y[o] += products.sum();
  }
}

void run_wide(const PackedView& network, const PackedLayer& layer, const float* x, float* y,
              std::byte* rest) noexcept {
  constexpr int kMost = lanes_of(kAccumulators);
  switch (layer.precision) {
    case Precision::kFloat32:
      if (network.header().bytes > kNearBytes) {
        return run_panels<kMost>(network, layer, Float32Kernel<true>{x}, y);
      }
      return run_panels<kMost>(network, layer, Float32Kernel<false>{x}, y);
    case Precision::kBfloat16:
      return run_panels<kMost>(network, layer, Bfloat16Kernel{x}, y);
    case Precision::kInt8: {
      const std::size_t count = padded(layer.inputs, kLineLanes);
      auto* const value = reinterpret_cast<std::int16_t*>(rest);
      auto* const high = reinterpret_cast<std::uint8_t*>(value + count);
      Int8Kernel kernel{{value, high, high + count, 0.0F}};
      quantise(x, count, layer.input_step, kernel.x);
      return run_panels<lanes_of(kAccumulators / 2)>(network, layer, kernel, y);
    }
  }
}

void run_layer(const PackedView& network, const PackedLayer& layer, const float* x, float* y,
               std::byte* rest) noexcept {
  if (has_few_outputs(layer)) {
    run_rows(network, layer, x, y);
  } else {
    run_wide(network, layer, x, y, rest);
  }
  activate(layer.activation, y, padded(layer.outputs, kLineLanes));
}

}  // namespace

void RAVENCAL_FORWARD(const PackedView& network, const float* inputs, float* outputs,
                      std::byte* scratch) noexcept;

void RAVENCAL_FORWARD(const PackedView& network, const float* inputs, float* outputs,
                      std::byte* scratch) noexcept {
  const PackedHeader& header = network.header();
  for (std::size_t at = 0; at < kAheadBytes; at += kLineBytes)
    __builtin_prefetch(network.base + at);
  auto* x = reinterpret_cast<float*>(scratch);
  float* y = x + header.widest;
  auto* const rest = reinterpret_cast<std::byte*>(y + header.widest);
  const std::size_t count = network.layer(0).inputs;
  const bool is_recurrent = network.layer(0).kind == LayerKind::kGruInput;
  const float poison = is_recurrent ? nan_or_zero(inputs, count) : 0.0F;
  take_inputs(inputs, count, poison == 0.0F, x);
  for (std::size_t i = count; i < padded(count, kLineLanes); ++i) x[i] = 0.0F;
  for (std::size_t l = 0; l < header.layers; ++l) {
    const PackedLayer layer = network.layer(l);
    if (layer.kind == LayerKind::kGruRecurrent) {
      run_gru(network, layer, x, y, scratch + scratch_bytes(header.widest));
    } else {
      run_layer(network, layer, x, y, rest);
    }
    float* const swapped = x;
    x = y;
    y = swapped;
  }
  for (std::size_t i = 0; i < network.layer(header.layers - 1).outputs; ++i)
    outputs[i] = x[i] + poison;
}

}  // namespace ravencal::kernels
