// SPDX-License-Identifier: Apache-2.0
//
// Fork and join for loops of a few microseconds to milliseconds: workers spin briefly, then yield,
// then sleep, to leave the processor to others on a busy machine. One thread calls run().
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "core/first_exception.hpp"

namespace ravencal::learn {

class ThreadPool {
 public:
  /// `threads` workers in all, the caller of run() included; at least 1. Fewer where the system
  /// allows no more threads.
  explicit ThreadPool(unsigned threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  [[nodiscard]] unsigned size() const { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls task(index, worker) for every index in [0, count), each once, and returns when all are
  /// done. `worker` < size() names the thread. What a task throws comes out of this call.
  void run(std::size_t count, const std::function<void(std::size_t, unsigned)>& task);

 private:
  void work(unsigned worker);
  void take_tasks(unsigned worker);

  std::vector<std::thread> workers_;
  const std::function<void(std::size_t, unsigned)>* task_ = nullptr;  ///< written before round_
  std::size_t count_ = 0;                                             ///< written before round_
  std::atomic<std::size_t> next_{0};                                  ///< next index to take
  std::atomic<unsigned> finished_{0};    ///< workers that are done with this round
  std::atomic<std::uint32_t> round_{0};  ///< incremented by run(); workers wait for it
  std::atomic<bool> stop_{false};
  core::FirstException thrown_;
};

}  // namespace ravencal::learn
