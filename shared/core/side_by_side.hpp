// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <system_error>
#include <thread>
#include <vector>

namespace ravencal::core {

/// Calls `work()` on `threads` threads, the calling one among them, and returns when all are done.
/// `work` takes its share from a place common to all, so that where the system allows no more
/// threads, fewer do the same work. It must not throw.
template <typename Work>
void side_by_side(std::size_t threads, const Work& work) {
  std::vector<std::jthread> helpers;
  helpers.reserve(threads);
  try {
    while (helpers.size() + 1 < threads) helpers.emplace_back([&work] { work(); });
  } catch (const std::system_error&) {  // as few as there are
  }
  work();
}

}  // namespace ravencal::core
