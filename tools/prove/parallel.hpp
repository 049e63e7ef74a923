// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>

#include "core/result.hpp"
#include "core/side_by_side.hpp"

namespace ravencal::prove {

/// Runs work(i) for i in [0, count) on `jobs` threads, each giving a Status. The first failure
/// stops the others after their present item and is returned.
template <typename Work>
core::Status in_parallel(std::size_t count, unsigned jobs, Work&& work) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  core::Status first;
  const auto loop = [&] {
    for (std::size_t i = next++; i < count && !stop; i = next++) {
      const core::Status status = work(i);
      if (status.ok()) continue;
      const std::lock_guard<std::mutex> lock(mutex);
      if (first.ok()) first = status;
      stop = true;
    }
  };
  core::side_by_side(jobs, loop);
  return first;
}

}  // namespace ravencal::prove
