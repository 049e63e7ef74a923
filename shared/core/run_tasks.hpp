// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/result.hpp"
#include "core/side_by_side.hpp"

namespace ravencal::core {

struct TasksDone {
  std::size_t finished = 0;
  bool interrupted = false;  ///< not all were finished
};

/// Long tasks side by side, on `threads` threads (0: one per core). `task(i, report)`, once for
/// each i in [0, count), gives a Result<bool>: true if it is done, false if it was stopped. It
/// tells `report` the share of it that is done, and stops where that returns false. `progress(share
/// of all, tasks finished, i)` is called by one thread at a time, and stops the rest by returning
/// false; so does the first error, which is returned.
template <typename Task, typename Progress>
Result<TasksDone> run_tasks(std::size_t count, unsigned threads, const Task& task,
                            const Progress& progress) {
  std::vector<std::atomic<double>> shares(count);
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> finished{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;  // of progress and error
  std::optional<Error> error;
  const auto report = [&](std::size_t index, double share) {
    shares[index] = share;
    double sum = 0.0;
    for (const std::atomic<double>& own : shares) sum += own;
    const std::lock_guard<std::mutex> lock(mutex);
    if (!stop && !progress(sum / static_cast<double>(count), finished.load(), index)) stop = true;
    return !stop;
  };
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  side_by_side(std::min<std::size_t>(count, threads == 0 ? cores : threads), [&] {
    for (std::size_t i = next++; i < count && !stop; i = next++) {
      const Result<bool> done = task(i, [&](double share) { return report(i, share); });
      if (!done.ok()) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!error) error = done.error();
        stop = true;
      } else if (*done) {
        ++finished;
        report(i, 1.0);
      }
    }
  });
  if (error) return *error;
  return TasksDone{finished, finished < count};
}

}  // namespace ravencal::core
