// SPDX-License-Identifier: Apache-2.0
//
// Every network of RAVENCAL_TOPOLOGIES for one instruction set. CMake compiles this file once per
// set, with that set's flags and
//   RAVENCAL_KERNELS   the function to define, e.g. avx2_kernels
//   Eigen              renamed, e.g. to Eigen_avx2
// The renaming is what makes this safe: Eigen is all templates, and the linker keeps one copy of
// equal names. Without it a baseline step could end up with the AVX-512 copy of an Eigen function
// and die on an older processor. For the same reason the unit calls no inline function that other
// units call (a test reads the symbols of the objects).
#include "model/network.hpp"
#include "rt_plugin/kernels.hpp"
#include "rt_plugin/topologies.hpp"

namespace ravencal::rt {
namespace {

struct RAVENCAL_KERNELS_TAG;  // internal: FixedNetwork's names differ in every unit

template <std::uint32_t... kSizes>
constexpr NetworkKernel kernel() noexcept {
  using Network = model::FixedNetwork<RAVENCAL_KERNELS_TAG, kSizes...>;
  return {Network::kShape, &Network::run};
}

#define RAVENCAL_TOPOLOGY(...) kernel<__VA_ARGS__>(),
constexpr NetworkKernel kKernels[] = {RAVENCAL_FOR_EACH_TOPOLOGY(RAVENCAL_TOPOLOGY)};
#undef RAVENCAL_TOPOLOGY

}  // namespace

std::span<const NetworkKernel> RAVENCAL_KERNELS() noexcept { return kKernels; }

}  // namespace ravencal::rt
