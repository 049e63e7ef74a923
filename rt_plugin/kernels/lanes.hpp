// SPDX-License-Identifier: Apache-2.0
//
// Eigen arrays of fixed size over packed memory, and the functions that a network applies to them.
// For forward_unit.cpp only: the linker must never merge the code of two instruction sets, so
// everything is in an unnamed namespace or in Eigen's, which CMake renames per set.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/forward.hpp"

// What keeps the heap out is that every size is fixed, and plugin_abi_test, which allows the
// kernels no call of a library but memory's; this is only an assertion in Eigen's allocator.
#define EIGEN_NO_MALLOC
// Eigen's own prints and aborts, which a robot's process must not find in a library.
#if defined(NDEBUG)
#define eigen_assert(condition) static_cast<void>(0)
#else
#define eigen_assert(condition) ((condition) ? static_cast<void>(0) : __builtin_trap())
#endif
#include <Eigen/Core>

#define RAVENCAL_INLINE [[gnu::always_inline]] inline

namespace ravencal::kernels {
namespace {

constexpr int kVectorBytes = EIGEN_MAX_ALIGN_BYTES;  ///< of the instruction set's widest vector
constexpr int kWidth = kVectorBytes / 4;             ///< 32-bit lanes
constexpr int kLine = kLineLanes;

template <int kLanes>
using Lanes = Eigen::Array<float, kLanes, 1>;
using Line = Lanes<kLine>;

/// Lanes in memory are aligned to their own size, or to a line.
template <int kLanes>
inline constexpr int kAlignment = kLanes < kLine ? 4 * kLanes : int{Eigen::Aligned64};
template <int kLanes>
using From = Eigen::Map<const Lanes<kLanes>, kAlignment<kLanes>>;
template <int kLanes>
using To = Eigen::Map<Lanes<kLanes>, kAlignment<kLanes>>;

/// In [-1, 1], absolute error below model::kTanhError.
RAVENCAL_INLINE Line hyperbolic_tangent(const Line& x) noexcept { return x.tanh(); }

/// 1 / (1 + exp(-x)) in [0, 1], absolute error below model::kSigmoidError. Eigen's logistic() would
/// branch on the data.
RAVENCAL_INLINE Line sigmoid(const Line& x) noexcept {
  return hyperbolic_tangent(x * 0.5F) * 0.5F + 0.5F;
}

/// NaN stays NaN: on every instruction set Eigen's max is its first operand then.
RAVENCAL_INLINE Line rectified(const Line& x) noexcept { return x.max(0.0F); }

/// Turns `count` sums (whole lines) into outputs. One pass for every kind of weights, behind the
/// sums: their loops stay short, and with cold caches a pass waits for its own code.
[[gnu::noinline]] void activate(model::Activation activation, float* y,
                                std::size_t count) noexcept {
  const auto each_line = [&](auto function) {
    for (std::size_t i = 0; i < count; i += kLine) To<kLine>(y + i) = function(From<kLine>(y + i));
  };
  switch (activation) {
    case model::Activation::kLinear:
      return;
    case model::Activation::kSigmoid:
      return each_line([](const Line& x) { return sigmoid(x); });
    case model::Activation::kTanh:
      return each_line([](const Line& x) { return hyperbolic_tangent(x); });
    case model::Activation::kRelu:
      return each_line([](const Line& x) { return rectified(x); });
  }
}

}  // namespace
}  // namespace ravencal::kernels
