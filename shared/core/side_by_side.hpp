// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace ravencal::core
