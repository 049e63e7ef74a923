// SPDX-License-Identifier: Apache-2.0
//
// A network whose sizes are known when it is compiled, over one block of memory ("arena") that the
// caller owns: the real-time form of CalibrationModel. Smaller networks fit by zero padding: a
// missing input has a range of zero width at zero, a missing unit has zero weights in and out.
// Nothing here allocates, and the time does not depend on the data (denormals apart: the caller
// flushes them).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "model/kinds.hpp"
#include "model/layers.hpp"

namespace ravencal::model {

/// Sizes of a network from inputs to outputs, and where its parts lie in an arena, in floats.
/// Every part starts on a 64-byte line. Weights are stored by columns of `rows` floats.
struct NetworkShape {
  static constexpr std::size_t kMaxLayers = 6;
  static constexpr std::size_t kLineFloats = 16;

  std::array<std::uint32_t, kMaxLayers + 1> sizes{};  ///< inputs, hidden ..., outputs
  std::uint32_t layers = 0;

  static constexpr std::size_t to_lines(std::size_t floats) noexcept {
    return (floats + kLineFloats - 1) / kLineFloats * kLineFloats;
  }

  [[nodiscard]] constexpr std::size_t inputs() const noexcept { return sizes[0]; }
  [[nodiscard]] constexpr std::size_t outputs() const noexcept { return sizes[layers]; }
  /// Stored rows of layer l: whole lines, so that no column of weights straddles one.
  [[nodiscard]] constexpr std::size_t rows(std::size_t l) const noexcept {
    return to_lines(sizes[l + 1]);
  }

  // Scaling: lowest and highest input, mean, inverse scale.
  [[nodiscard]] constexpr std::size_t low_at() const noexcept { return 0; }
  [[nodiscard]] constexpr std::size_t high_at() const noexcept { return to_lines(inputs()); }
  [[nodiscard]] constexpr std::size_t mean_at() const noexcept { return 2 * to_lines(inputs()); }
  [[nodiscard]] constexpr std::size_t inverse_scale_at() const noexcept {
    return 3 * to_lines(inputs());
  }
  [[nodiscard]] constexpr std::size_t weights_at(std::size_t l) const noexcept {
    std::size_t at = 4 * to_lines(inputs());
    for (std::size_t before = 0; before < l; ++before) at += rows(before) * (sizes[before] + 1);
    return at;
  }
  [[nodiscard]] constexpr std::size_t biases_at(std::size_t l) const noexcept {
    return weights_at(l) + rows(l) * sizes[l];
  }
  [[nodiscard]] constexpr std::size_t output_mean_at() const noexcept { return weights_at(layers); }
  [[nodiscard]] constexpr std::size_t output_scale_at() const noexcept {
    return output_mean_at() + to_lines(outputs());
  }
  [[nodiscard]] constexpr std::size_t arena_floats() const noexcept {
    return output_scale_at() + to_lines(outputs());
  }
};

/// `Tag` tells apart instantiations for different instruction sets: without it the linker would
/// merge equal names and could give an old processor the code of a new one.
template <typename Tag, std::uint32_t... kSizes>
class FixedNetwork {
  static_assert(sizeof...(kSizes) >= 2 && sizeof...(kSizes) <= NetworkShape::kMaxLayers + 1);

 public:
  // clang-tidy 14 takes constants that depend on template arguments for variables.
  // NOLINTNEXTLINE(bugprone-dynamic-static-initializers)
  static constexpr NetworkShape kShape = {{kSizes...}, sizeof...(kSizes) - 1};

  /// features [inputs] in SI units -> outputs [outputs] in SI units; `arena` [arena_floats] and
  /// `features` are 64-byte aligned, `activations` has one entry per layer. Inputs are clamped
  /// first (input_limits.hpp), so that the network never extrapolates far.
  static void run(const float* arena, const Activation* activations, const float* features,
                  float* outputs) noexcept {
    const auto low = line<kInputs>(arena + kShape.low_at());
    const auto high = line<kInputs>(arena + kShape.high_at());
    Column<kInputs> scaled = line<kInputs>(features).cwiseMax(low).cwiseMin(high);
    standardise(line<kInputs>(arena + kShape.mean_at()),
                line<kInputs>(arena + kShape.inverse_scale_at()), scaled, scaled);
    layer<0>(arena, activations, scaled, outputs);
  }

 private:
  // NOLINTNEXTLINE(bugprone-dynamic-static-initializers): as above
  static constexpr int kInputs = static_cast<int>(NetworkShape::to_lines(kShape.sizes[0]));

  template <int kRows>
  using Column = Eigen::Matrix<float, kRows, 1>;

  template <int kRows>
  static Eigen::Map<const Column<kRows>, Eigen::Aligned64> line(const float* at) noexcept {
    return Eigen::Map<const Column<kRows>, Eigen::Aligned64>(at);
  }

  /// Layer l and those after it; `x` holds whole lines, of which the layer reads its inputs.
  template <std::size_t l, typename X>
  static void layer(const float* arena, const Activation* activations, const X& x,
                    float* outputs) noexcept {
    constexpr int kRows = static_cast<int>(kShape.rows(l));
    constexpr int kColumns = static_cast<int>(kShape.sizes[l]);
    using Weights = Eigen::Matrix<float, kRows, kColumns, Eigen::ColMajor>;
    const Eigen::Map<const Weights, Eigen::Aligned64> weights(arena + kShape.weights_at(l));
    alignas(64) Column<kRows> y;
    dense(weights, line<kRows>(arena + kShape.biases_at(l)), activations[l],
          x.template head<kColumns>(), y);
    if constexpr (l + 1 < kShape.layers) {
      layer<l + 1>(arena, activations, y, outputs);
    } else {
      unstandardise(line<kRows>(arena + kShape.output_mean_at()),
                    line<kRows>(arena + kShape.output_scale_at()), y);
      for (std::size_t j = 0; j < kShape.outputs(); ++j) outputs[j] = y[static_cast<int>(j)];
    }
  }
};

}  // namespace ravencal::model
