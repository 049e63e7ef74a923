// SPDX-License-Identifier: Apache-2.0
//
// How a layer's weights are read: panel after panel, front to back, so that the processor's
// prefetcher runs ahead: with cold caches a pass takes as long as reading them does. For
// forward_unit.cpp only.
#pragma once

#include "kernels/forward.hpp"
#include "kernels/lanes.hpp"

namespace ravencal::kernels {
namespace {

/// Accumulators that fit into registers beside weights and input.
constexpr int kAccumulators = 8;

/// How far ahead of their use weights are asked for. The processor's own prefetcher stops at every
/// page and idles while sums are finished; with cold caches this saves a tenth of the time, with
/// warm ones it costs a twentieth (measured on Zen 5 over 2 to 16 KiB).
constexpr std::size_t kAheadBytes = 8192;

/// Asks for the lines of `kBytes` bytes that are kAheadBytes behind `at`; behind the block's end
/// that does nothing.
template <int kBytes>
RAVENCAL_INLINE void fetch_ahead(const void* at) noexcept {
  const auto* const ahead = static_cast<const std::byte*>(at) + kAheadBytes;
  for (std::size_t i = 0; i < kBytes; i += kLineBytes) __builtin_prefetch(ahead + i);
}

/// What a panel's kernel reads and writes, at its first lane. `lanes` is the panel's width.
struct Panel {
  std::size_t lanes;
  std::size_t inputs;  ///< with padding
  const std::byte* weights;
  const float* biases;
  const float* row_scales;
  const std::int32_t* row_sums;
  float* y;
};

/// Runs a kernel over a layer's panels, kMost lanes at a time or a line where fewer are left.
template <int kMost, typename Kernel>
[[gnu::noinline]] void run_panels(const PackedView& network, const PackedLayer& layer,
                                  const Kernel& kernel, float* y) noexcept {
  const std::size_t all_lanes = padded(layer.outputs, kLineLanes);
  const std::byte* const base = network.base;
  const std::size_t bytes_per_lane = weight_bytes(layer) / all_lanes;
  for (std::size_t first = 0; first < all_lanes; first += kPanelLanes) {
    Panel panel = {};
    panel.lanes = all_lanes - first < kPanelLanes ? all_lanes - first : kPanelLanes;
    panel.inputs = padded(layer.inputs, inputs_side_by_side(layer));
    panel.weights = base + layer.weights_at + first * bytes_per_lane;
    panel.biases = reinterpret_cast<const float*>(base + layer.biases_at) + first;
    panel.row_scales = reinterpret_cast<const float*>(base + layer.row_scales_at) + first;
    panel.row_sums = reinterpret_cast<const std::int32_t*>(base + layer.row_sums_at) + first;
    panel.y = y + first;
    std::size_t lane = 0;
    for (; lane + kMost <= panel.lanes; lane += kMost) kernel.template run<kMost>(panel, lane);
    if constexpr (kMost > kLine) {
      for (; lane < panel.lanes; lane += kLine) kernel.template run<kLine>(panel, lane);
    }
  }
}

/// Lanes of so many vectors, within a panel.
constexpr int lanes_of(int vectors) noexcept {
  constexpr int kPanel = kPanelLanes;
  return vectors * kWidth < kPanel ? vectors * kWidth : kPanel;
}

}  // namespace
}  // namespace ravencal::kernels
