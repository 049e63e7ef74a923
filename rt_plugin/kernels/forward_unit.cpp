// SPDX-License-Identifier: Apache-2.0
//
// The forward pass for one instruction set. CMake compiles this file once per set, with that set's
// flags and RAVENCAL_FORWARD, the function to define. Weights are read front to back, so that the
// processor's prefetcher runs ahead: with cold caches the pass takes as long as reading them does.
#include "kernels/forward.hpp"
#include "kernels/gru.hpp"
#include "kernels/int8_dot.hpp"
#include "kernels/vector.hpp"

namespace ravencal::kernels {
namespace {

/// Accumulators that fit into registers beside weights and input.
constexpr std::size_t kAccumulators = 8;

/// How far ahead of their use weights are asked for. The processor's own prefetcher stops at every
/// page and idles while sums are finished; with cold caches this saves a tenth of the time, with
/// warm ones it costs a twentieth (measured on Zen 5 over 2 to 16 KiB).
constexpr std::size_t kAheadBytes = 8192;

/// A network of fewer bytes soon comes from the first caches, where asking ahead costs a fifth.
constexpr std::size_t kNearBytes = 262144;

/// Asks for the line that is kAheadBytes behind `at`; behind the block's end that does nothing.
RAVENCAL_INLINE void fetch_ahead(const void* at) noexcept {
  __builtin_prefetch(static_cast<const std::byte*>(at) + kAheadBytes);
}

/// What a panel's kernel reads and writes, at its first lane. `lanes` is the panel's width.
struct Panel {
  std::size_t lanes;
  std::size_t inputs;
  const std::byte* weights;
  const float* biases;
  const float* row_scales;
  const std::int32_t* row_sums;
  model::Activation activation;
  float poison;  ///< kInt8: NaN if an input was NaN, else 0
  float* y;
};

/// kVectors * kWidth outputs from lane `lane` on, f32 weights. Several sums run side by side where
/// there are few vectors, to hide the latency of the multiplication. kFar: the network is so large
/// that it is worth asking ahead.
template <bool kFar>
struct Float32Kernel {
  const float* x;

  template <std::size_t kVectors>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    constexpr std::size_t kChains = kAccumulators / kVectors;
    Floats sums[kChains][kVectors] = {};
    for (std::size_t v = 0; v < kVectors; ++v) {
      sums[0][v] = load<Floats>(panel.biases + lane + v * kWidth);
    }
    const float* w = reinterpret_cast<const float*>(panel.weights) + lane;
    std::size_t i = 0;
    for (; i + kChains <= panel.inputs; i += kChains) {
      for (std::size_t c = 0; c < kChains; ++c, w += panel.lanes) {
        for (std::size_t v = 0; v < kVectors; ++v) {
          if constexpr (kFar) fetch_ahead(w + v * kWidth);
          sums[c][v] += load<Floats>(w + v * kWidth) * broadcast(x[i + c]);
        }
      }
    }
    for (; i < panel.inputs; ++i, w += panel.lanes) {
      for (std::size_t v = 0; v < kVectors; ++v) {
        sums[0][v] += load<Floats>(w + v * kWidth) * broadcast(x[i]);
      }
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
      Floats total = sums[0][v];
      for (std::size_t c = 1; c < kChains; ++c) total += sums[c][v];
      store(panel.y + lane + v * kWidth, activated(panel.activation, total));
    }
  }
};

/// A bfloat16 is the upper half of an f32; of the two in a lane the first is the lower one.
struct Bfloat16Kernel {
  const float* x;  ///< finite behind the last input, where the weights are zero

  template <std::size_t kVectors>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    constexpr std::size_t kChains = kVectors <= kAccumulators / 2 ? 2 : 1;
    Floats sums[kChains][kVectors] = {};
    for (std::size_t v = 0; v < kVectors; ++v) {
      sums[0][v] = load<Floats>(panel.biases + lane + v * kWidth);
    }
    const auto* w = reinterpret_cast<const std::uint32_t*>(panel.weights) + lane;
    for (std::size_t i = 0; i < panel.inputs; i += 2, w += panel.lanes) {
      for (std::size_t v = 0; v < kVectors; ++v) {
        fetch_ahead(w + v * kWidth);
        const Words pair = load<Words>(w + v * kWidth);
        sums[0][v] += same_bits<Floats>(pair << 16U) * broadcast(x[i]);
        sums[kChains - 1][v] += same_bits<Floats>(pair & 0xFFFF0000U) * broadcast(x[i + 1]);
      }
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
      Floats total = sums[0][v];
      if constexpr (kChains == 2) total += sums[1][v];
      store(panel.y + lane + v * kWidth, activated(panel.activation, total));
    }
  }
};

struct Int8Kernel {
  QuantisedInputs x;

  template <std::size_t kVectors>
  RAVENCAL_INLINE void run(const Panel& panel, std::size_t lane) const noexcept {
    Int8Dot dots[kVectors];
    const auto* w = reinterpret_cast<const std::int8_t*>(panel.weights) + 4 * lane;
    for (std::size_t i = 0; i < panel.inputs; i += 4, w += 4 * panel.lanes) {
      const Int8Dot::Four four = Int8Dot::spread(x, i);
      for (std::size_t v = 0; v < kVectors; ++v) {
        fetch_ahead(w + v * kVectorBytes);
        dots[v].add(w + v * kVectorBytes, four);
      }
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
      const std::size_t at = lane + v * kWidth;
      const Floats sum = __builtin_convertvector(dots[v].sum(panel.row_sums + at), Floats);
      const Floats total = sum * load<Floats>(panel.row_scales + at) +
                           (load<Floats>(panel.biases + at) + broadcast(panel.poison));
      store(panel.y + at, activated(panel.activation, total));
    }
  }
};

/// Runs a kernel over a panel, at most kMost vectors at a time.
template <std::size_t kMost, typename Kernel>
RAVENCAL_INLINE void run_panel(const Kernel& kernel, const Panel& panel) noexcept {
  std::size_t lane = 0;
  for (; lane + kMost * kWidth <= panel.lanes; lane += kMost * kWidth) {
    kernel.template run<kMost>(panel, lane);
  }
  if constexpr (kMost > 1) {
    for (; lane + kLineLanes <= panel.lanes; lane += kLineLanes) {
      kernel.template run<kLineLanes / kWidth>(panel, lane);
    }
  }
}

template <std::size_t kMost, typename Kernel>
[[gnu::noinline]] void run_panels(const PackedView& network, const PackedLayer& layer,
                                  std::size_t input_group, const Kernel& kernel, float poison,
                                  float* y) noexcept {
  const std::size_t all_lanes = padded(layer.outputs, kLineLanes);
  const std::byte* const base = network.base;
  const std::size_t bytes_per_lane = weight_bytes(layer) / all_lanes;
  for (std::size_t first = 0; first < all_lanes; first += kPanelLanes) {
    Panel panel = {};
    panel.lanes = all_lanes - first < kPanelLanes ? all_lanes - first : kPanelLanes;
    panel.inputs = padded(layer.inputs, input_group);
    panel.weights = base + layer.weights_at + first * bytes_per_lane;
    panel.biases = reinterpret_cast<const float*>(base + layer.biases_at) + first;
    panel.row_scales = reinterpret_cast<const float*>(base + layer.row_scales_at) + first;
    panel.row_sums = reinterpret_cast<const std::int32_t*>(base + layer.row_sums_at) + first;
    panel.activation = layer.activation;
    panel.poison = poison;
    panel.y = y + first;
    run_panel<kMost>(kernel, panel);
  }
}

/// Quantises `count` (a multiple of 16) floats; returns NaN if one of them was NaN, else 0.
[[gnu::noinline]] float quantise(const float* x, std::size_t count, float step,
                                 [[maybe_unused]] std::int16_t* value,
                                 [[maybe_unused]] std::uint8_t* high,
                                 [[maybe_unused]] std::uint8_t* low) noexcept {
  const Floats inverse_step = broadcast(1.0F / step);
  Ints any_nan{};
  for (std::size_t i = 0; i < count; i += kWidth) {
    const Floats input = load<Floats>(x + i);
    any_nan |= input != input;
    const Floats units = clamp(input * inverse_step, -32767.0F, 32767.0F);
    const Ints q =
        same_bits<Ints>(units + broadcast(kRounder)) - same_bits<Ints>(broadcast(kRounder));
    if constexpr (Int8Dot::kTakesBytes) {
      store(high + i, __builtin_convertvector(((q >> 8) + 128) & 255, Bytes));
      store(low + i, __builtin_convertvector(q & 255, Bytes));
    } else {
      store(value + i, __builtin_convertvector(q, Shorts));
    }
  }
  std::int32_t mask = 0;
  for (std::size_t i = 0; i < kWidth; ++i) mask |= any_nan[i];
  const std::uint32_t bits = static_cast<std::uint32_t>(mask) & 0x7FC00000U;
  float poison = 0.0F;
  std::memcpy(&poison, &bits, sizeof(poison));
  return poison;
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

/// A layer of few outputs: one f32 row each.
[[gnu::noinline]] void run_rows(const PackedView& network, const PackedLayer& layer, const float* x,
                                float* y) noexcept {
  const std::size_t row = padded(layer.inputs, kLineLanes);
  const auto* w = reinterpret_cast<const float*>(network.base + layer.weights_at);
  alignas(kLineBytes) float sums[kLineLanes] = {};
  for (std::size_t o = 0; o < layer.outputs; ++o, w += row) {
    Floats parts[kLineLanes / kWidth] = {};
    for (std::size_t i = 0; i < row; i += kLineLanes) {
      for (std::size_t v = 0; v < kLineLanes / kWidth; ++v) {
        parts[v] += load<Floats>(w + i + v * kWidth) * load<Floats>(x + i + v * kWidth);
      }
    }
    Floats all = parts[0];
    for (std::size_t v = 1; v < kLineLanes / kWidth; ++v) all += parts[v];
    for (std::size_t i = 0; i < kWidth; ++i) sums[o] += all[i];
  }
  const auto* biases = reinterpret_cast<const float*>(network.base + layer.biases_at);
  for (std::size_t i = 0; i < kLineLanes; i += kWidth) {
    const Floats total = load<Floats>(sums + i) + load<Floats>(biases + i);
    store(y + i, activated(layer.activation, total));
  }
}

/// Vectors whose sums fit into the registers, for a panel of kPanelLanes.
constexpr std::size_t at_most(std::size_t vectors) noexcept {
  return vectors < kPanelLanes / kWidth ? vectors : kPanelLanes / kWidth;
}

void run_layer(const PackedView& network, const PackedLayer& layer, const float* x, float* y,
               std::byte* rest) noexcept {
  if (has_few_outputs(layer)) return run_rows(network, layer, x, y);
  switch (layer.precision) {
    case Precision::kFloat32: {
      constexpr std::size_t kMost = at_most(kAccumulators);
      if (network.header().bytes > kNearBytes) {
        return run_panels<kMost>(network, layer, 1, Float32Kernel<true>{x}, 0.0F, y);
      }
      return run_panels<kMost>(network, layer, 1, Float32Kernel<false>{x}, 0.0F, y);
    }
    case Precision::kBfloat16:
      return run_panels<at_most(kAccumulators)>(network, layer, 2, Bfloat16Kernel{x}, 0.0F, y);
    case Precision::kInt8: {
      const std::size_t count = padded(layer.inputs, kLineLanes);
      auto* const value = reinterpret_cast<std::int16_t*>(rest);
      auto* const high = reinterpret_cast<std::uint8_t*>(value + count);
      auto* const low = high + count;
      const float poison = quantise(x, count, layer.input_step, value, high, low);
      const Int8Kernel kernel{{value, high, low}};
      return run_panels<at_most(kAccumulators / 2)>(network, layer, 4, kernel, poison, y);
    }
  }
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
