// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

#include "core/first_exception.hpp"

namespace ravencal::core {

/// Calls `work()` on `threads` threads, the calling one among them, and returns when all are done.
/// `work` takes its share from a place common to all, so that where the system allows no more
/// threads, fewer do the same work. What one of them throws comes out of this call, when all are
/// done.
template <typename Work>
void side_by_side(std::size_t threads, const Work& work) {
  FirstException thrown;
  {
    std::vector<std::jthread> helpers;
    try {
      helpers.reserve(threads);
      while (helpers.size() + 1 < threads) helpers.emplace_back([&] { thrown.guard(work); });
    } catch (const std::exception&) {  // as few as there is room for
    }
    thrown.guard(work);
  }
  thrown.rethrow();
}

/// Calls `work(i)` once for each i in [0, count), on `threads` threads (0: one per core). Where
/// each i writes only its own result, the result is the same on any number of threads.
template <typename Work>
void for_each_index(std::size_t count, unsigned threads, const Work& work) {
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  std::atomic<std::size_t> next{0};
  side_by_side(std::min<std::size_t>(count, threads == 0 ? cores : threads), [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  });
}

}  // namespace ravencal::core
