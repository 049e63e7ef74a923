// SPDX-License-Identifier: Apache-2.0
#include "learn/thread_pool.hpp"

#include <algorithm>
#include <exception>

namespace ravencal::learn {
namespace {

constexpr int kSpins = 2000;  ///< about 20 us: longer than the gaps between the loops of a step
constexpr int kYields = 200;  ///< then let others run before going to sleep

void pause_briefly() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Waits until done() is true; false if it gave up.
template <typename Done>
bool spin_then_yield(const Done& done) {
  for (int i = 0; i < kSpins + kYields; ++i) {
    if (done()) return true;
    if (i < kSpins) {
      pause_briefly();
    } else {
      std::this_thread::yield();
    }
  }
  return false;
}

}  // namespace

ThreadPool::ThreadPool(unsigned threads) {
  try {
    workers_.reserve(threads);
    for (unsigned worker = 1; worker < std::max(1U, threads); ++worker) {
      workers_.emplace_back([this, worker] { work(worker); });
    }
  } catch (const std::exception&) {  // as few as there is room for
  }
}

ThreadPool::~ThreadPool() {
  stop_.store(true, std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::run(std::size_t count, const std::function<void(std::size_t, unsigned)>& task) {
  if (workers_.empty() || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) task(i, 0);
    return;
  }
  task_ = &task;
  count_ = count;
  next_.store(0, std::memory_order_relaxed);
  finished_.store(0, std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  thrown_.guard([this] { take_tasks(0); });
  const auto expected = static_cast<unsigned>(workers_.size());
  const auto all_done = [&] { return finished_.load(std::memory_order_acquire) == expected; };
  while (!spin_then_yield(all_done)) {
    const unsigned seen = finished_.load(std::memory_order_acquire);
    if (seen != expected) finished_.wait(seen, std::memory_order_acquire);
  }
  thrown_.rethrow();
}

void ThreadPool::take_tasks(unsigned worker) {
  for (;;) {
    const std::size_t index = next_.fetch_add(1, std::memory_order_relaxed);
    if (index >= count_) return;
    (*task_)(index, worker);
  }
}

void ThreadPool::work(unsigned worker) {
  std::uint32_t seen = 0;
  for (;;) {
    const auto called = [&] { return round_.load(std::memory_order_acquire) != seen; };
    if (!spin_then_yield(called)) round_.wait(seen, std::memory_order_acquire);
    seen = round_.load(std::memory_order_acquire);
    if (stop_.load(std::memory_order_relaxed)) return;
    thrown_.guard([&] { take_tasks(worker); });
    finished_.fetch_add(1, std::memory_order_release);
    finished_.notify_one();
  }
}

}  // namespace ravencal::learn
