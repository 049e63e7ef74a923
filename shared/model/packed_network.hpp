// SPDX-License-Identifier: Apache-2.0
//
// The weights of a network in the order in which the kernels read them, usable in place from a
// mapped file: one block of memory that starts on a 64-byte line, read front to back once a tick.
// Little-endian. Nothing here owns or allocates memory.
//
// A wide layer is cut into panels of kPanelLanes outputs (the last one as many whole lines of 16 as
// it needs). A panel holds, input after input, the weights of its lanes; padding is zero:
//   kFloat32   [input][lane]           f32
//   kBfloat16  [input / 2][lane][2]    upper half of an f32: 2 inputs side by side
//   kInt8      [input / 4][lane][4]    s8: 4 inputs side by side
// A GRU (gated recurrent unit, Cho et al. 2014, the form whose reset gate acts behind the recurrent
// product) is two layers side by side: kGruInput projects the inputs, kGruRecurrent the state. Each
// has three blocks of padded(units, kLineLanes) outputs, for the update gate, the reset gate and
// the candidate; padded outputs have zero weights and biases. It runs over a window of samples that
// lie stride_rows rows apart, from a state of zero, and hands the last state on.
// A layer of at most kFewOutputs outputs is stored as f32 rows in every precision: it has next to
// no bytes to save, and its rounding would go straight to the output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "model/kinds.hpp"

namespace ravencal::model::packed {

enum class Precision : std::uint8_t { kFloat32 = 0, kBfloat16 = 1, kInt8 = 2 };

enum class LayerKind : std::uint8_t { kDense = 0, kGruInput = 1, kGruRecurrent = 2 };

inline constexpr std::size_t kLineBytes = 64;
inline constexpr std::size_t kLineLanes = 16;
inline constexpr std::size_t kPanelLanes = 64;
inline constexpr std::uint32_t kFewOutputs = 8;
inline constexpr std::uint32_t kMaxWidth = 8192;  ///< inputs or outputs of a layer
inline constexpr std::uint32_t kMaxLayers = 16;
inline constexpr std::uint8_t kMaxWindow = 8;         ///< samples that a GRU looks at
inline constexpr std::uint32_t kMaxStrideRows = 256;  ///< rows between two of them
inline constexpr int kMaxWeightUnits = 127;           ///< kInt8
/// kInt8: largest sum of an output's |weights| in units. Times 32767, the largest quantised input,
/// it still fits into 32 bits, so that no kernel can overflow.
inline constexpr int kMaxRowUnits = 65535;

/// Where one layer lies: byte offsets from the start of the block, multiples of kLineBytes.
struct PackedLayer {
  std::uint32_t inputs;
  std::uint32_t outputs;
  Activation activation;
  Precision precision;
  LayerKind kind;
  std::uint8_t window;          ///< kGruRecurrent: samples looked at, 2 to kMaxWindow; else 0
  float input_step;             ///< kInt8: value of one unit of a quantised input
  std::uint64_t biases_at;      ///< f32, one per padded output
  std::uint64_t row_scales_at;  ///< kInt8: f32, value of one unit of a product sum; else 0
  std::uint64_t row_sums_at;    ///< kInt8: s32, sum of an output's weights; else 0
  std::uint64_t weights_at;
  std::uint64_t end;
  std::uint32_t stride_rows;  ///< kGruRecurrent: rows between two samples; else 0
  std::uint32_t reserved;
};
static_assert(sizeof(PackedLayer) == 64);

struct PackedHeader {
  std::uint32_t layers;
  std::uint32_t widest;  ///< largest padded number of inputs or outputs
  std::uint64_t bytes;   ///< of the whole block
  std::uint8_t reserved[48];
};
static_assert(sizeof(PackedHeader) == 64);

constexpr std::size_t padded(std::size_t count, std::size_t step) noexcept {
  return (count + step - 1) / step * step;
}

/// Inputs of the layer behind this one.
constexpr std::uint32_t passes_on(const PackedLayer& layer) noexcept {
  return layer.kind == LayerKind::kGruRecurrent ? layer.inputs : layer.outputs;
}

constexpr bool has_few_outputs(const PackedLayer& layer) noexcept {
  return layer.outputs <= kFewOutputs;
}

/// Bytes of a layer's weights.
constexpr std::size_t weight_bytes(const PackedLayer& layer) noexcept {
  const std::size_t lanes = padded(layer.outputs, kLineLanes);
  if (has_few_outputs(layer)) return layer.outputs * padded(layer.inputs, kLineLanes) * 4;
  switch (layer.precision) {
    case Precision::kFloat32:
      return std::size_t{layer.inputs} * lanes * 4;
    case Precision::kBfloat16:
      return padded(layer.inputs, 2) * lanes * 2;
    case Precision::kInt8:
      return padded(layer.inputs, 4) * lanes;
  }
  return 0;
}

/// How many inputs of one output lie side by side.
constexpr std::size_t inputs_side_by_side(const PackedLayer& layer) noexcept {
  if (layer.precision == Precision::kBfloat16) return 2;
  return layer.precision == Precision::kInt8 ? 4 : 1;
}

/// Index of a weight among the elements (f32, bf16 or s8) of its layer; also of padding.
constexpr std::size_t element_index(const PackedLayer& layer, std::size_t output,
                                    std::size_t input) noexcept {
  if (has_few_outputs(layer)) return output * padded(layer.inputs, kLineLanes) + input;
  const std::size_t group = inputs_side_by_side(layer);
  const std::size_t first = output / kPanelLanes * kPanelLanes;
  const std::size_t rest = padded(layer.outputs, kLineLanes) - first;
  const std::size_t lanes = rest < kPanelLanes ? rest : kPanelLanes;
  return first * padded(layer.inputs, group) + (input / group * lanes + (output - first)) * group +
         input % group;
}

/// Whether `layer` may stand behind `before`, or first if there is none. A GRU may only be first:
/// its window is one of inputs.
constexpr bool follows(const PackedLayer& layer, const PackedLayer* before) noexcept {
  const bool linear = layer.activation == Activation::kLinear;
  const bool behind_projection = before != nullptr && before->kind == LayerKind::kGruInput;
  switch (layer.kind) {
    case LayerKind::kDense:
      return layer.window == 0 && layer.stride_rows == 0 && !behind_projection &&
             (before == nullptr || passes_on(*before) == layer.inputs);
    case LayerKind::kGruInput:
      return linear && layer.window == 0 && layer.stride_rows == 0 && before == nullptr;
    case LayerKind::kGruRecurrent:
      return linear && behind_projection && layer.outputs == before->outputs &&
             layer.outputs == 3 * padded(layer.inputs, kLineLanes) && layer.window >= 2 &&
             layer.window <= kMaxWindow && layer.stride_rows >= 1 &&
             layer.stride_rows <= kMaxStrideRows;
  }
  return false;
}

/// A checked block. Borrowed; make one with open(). Its own functions need no alignment.
struct PackedView {
  const std::byte* base = nullptr;

  [[nodiscard]] PackedHeader header() const noexcept {
    PackedHeader header;
    std::memcpy(&header, base, sizeof(header));
    return header;
  }
  [[nodiscard]] PackedLayer layer(std::size_t l) const noexcept {
    PackedLayer layer;
    std::memcpy(&layer, base + sizeof(PackedHeader) + l * sizeof(layer), sizeof(layer));
    return layer;
  }
  /// The recurrent half of the network's GRU, or null-sized (window 0) if it has none.
  [[nodiscard]] PackedLayer recurrence() const noexcept {
    const bool is_recurrent = header().layers > 1 && layer(1).kind == LayerKind::kGruRecurrent;
    return is_recurrent ? layer(1) : PackedLayer{};
  }
  /// What a kernel multiplies with, as f32. For tools: one value at a time.
  [[nodiscard]] float weight(const PackedLayer& layer, std::size_t output,
                             std::size_t input) const noexcept;
  [[nodiscard]] float bias(const PackedLayer& layer, std::size_t output) const noexcept;
};

/// Checks that `bytes` bytes at `base` have the layout of a packed network (sizes, offsets, kinds;
/// not alignment, not the weights' values). False: `view` is unchanged.
bool open_anywhere(const std::byte* base, std::size_t bytes, PackedView& view) noexcept;

/// The same, and that it lies on a line: a kernel may read it without further checks.
bool open(const std::byte* base, std::size_t bytes, PackedView& view) noexcept;

/// A stored value that pack() does not write.
struct BadValue {
  bool found = false;
  bool in_padding = false;  ///< it should be zero; else it is not finite or out of range
  std::size_t at = 0;       ///< byte offset from the start of the block
};

/// The first bad value of a block, layer after layer.
BadValue find_bad_value(const PackedView& view) noexcept;

}  // namespace ravencal::model::packed
