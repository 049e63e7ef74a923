// SPDX-License-Identifier: Apache-2.0
//
// Compiled for this machine (step.cmake), so that it reads as wide as the processor can.
#include <sys/mman.h>

#include <cstring>

#include "bench/step_settings.hpp"

namespace ravencal::bench {
namespace {

constexpr std::size_t kBlock = 512;

}  // namespace

float read_bytes(const std::byte* at, std::size_t bytes) {
#if defined(__AVX512F__)
  using Line = float __attribute__((vector_size(64)));
#else
  using Line = float __attribute__((vector_size(32)));
#endif
  constexpr std::size_t kLines = kBlock / sizeof(Line);
  Line sums[kLines] = {};
  for (const std::byte* const end = at + bytes; at < end; at += kBlock) {
    for (std::size_t v = 0; v < kLines; ++v) {
      Line line;
      std::memcpy(&line, at + v * sizeof(Line), sizeof(Line));
      sums[v] += line;
    }
  }
  Line all = {};
  for (const Line& sum : sums) all += sum;
  return all[0];
}

std::shared_ptr<std::byte[]> huge_bytes(std::size_t bytes) {
  constexpr std::size_t kHuge = std::size_t{2} << 20U;
  const std::size_t whole = kernels::padded(bytes, kHuge);
  auto* const memory = static_cast<std::byte*>(std::aligned_alloc(kHuge, whole));
  ::madvise(memory, whole, MADV_HUGEPAGE);
  std::memset(memory, 0, whole);
  return {memory, [](std::byte* block) { std::free(block); }};
}

Peer bound_peer(std::size_t bytes) {
  const std::size_t whole = kernels::padded(bytes, kBlock);
  const auto block = huge_bytes(whole);
  Peer peer;
  peer.name = "bound: reading alone";
  peer.weight_bytes = bytes;
  peer.step = [block, whole](float* y) { y[0] = read_bytes(block.get(), whole); };
  return peer;
}

}  // namespace ravencal::bench
