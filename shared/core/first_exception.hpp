// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <mutex>
#include <utility>

namespace ravencal::core {

/// What threads throw, for the one that waits for them: an exception that leaves a thread ends the
/// process without a sentence.
class FirstException {
 public:
  /// Calls `work()` and keeps what it throws, unless another call threw before.
  template <typename Work>
  void guard(const Work& work) noexcept {
    try {
      work();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!first_) first_ = std::current_exception();
    }
  }

  /// Throws what was kept, once. Other threads are done.
  void rethrow() {
    if (first_) std::rethrow_exception(std::exchange(first_, nullptr));
  }

 private:
  std::mutex mutex_;
  std::exception_ptr first_;
};

}  // namespace ravencal::core
