// SPDX-License-Identifier: Apache-2.0
//
// The networks that were compiled in: every topology of RAVENCAL_TOPOLOGIES for every instruction
// set. load() chooses one; step() calls it through one function pointer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "model/kinds.hpp"
#include "model/network.hpp"

namespace ravencal::rt {

/// One compiled network. `run` is FixedNetwork::run.
struct NetworkKernel {
  model::NetworkShape shape;
  void (*run)(const float* arena, const model::Activation* activations, const float* features,
              float* outputs) noexcept = nullptr;
};

/// Compiled networks of one instruction set; empty where this build has none.
std::span<const NetworkKernel> baseline_kernels() noexcept;
std::span<const NetworkKernel> avx2_kernels() noexcept;
std::span<const NetworkKernel> avx512_kernels() noexcept;

struct KernelChoice {
  const NetworkKernel* kernel = nullptr;  ///< null if nothing fits
  std::uint32_t isa = 0;                  ///< RAVENCAL_ISA_*
};

/// The best instruction set that the processor has and `max_isa` (RAVENCAL_ISA_*) allows.
std::uint32_t best_isa(std::uint32_t max_isa) noexcept;

/// The smallest compiled network of instruction set `isa` that holds a network of these sizes
/// (inputs, hidden ..., outputs), each size at least as large and as many layers.
KernelChoice choose_kernel(std::span<const std::uint32_t> sizes, std::uint32_t isa) noexcept;

}  // namespace ravencal::rt
