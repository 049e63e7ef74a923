// SPDX-License-Identifier: Apache-2.0
#include "learn/thread_pool.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>

namespace ravencal::learn {
namespace {

TEST(ThreadPool, RunsEveryIndexOnceInEveryRound) {
  for (const unsigned threads : {1U, 2U, 7U}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.size(), threads);
    for (std::size_t count : {0U, 1U, 2U, 5U, 100U}) {
      for (int round = 0; round < 50; ++round) {
        std::vector<std::atomic<int>> calls(count);
        std::atomic<unsigned> highest{0};
        pool.run(count, [&](std::size_t index, unsigned worker) {
          ++calls[index];
          if (worker > highest) highest = worker;
        });
        for (const auto& call : calls) EXPECT_EQ(call, 1);
        EXPECT_LT(highest, threads);
      }
    }
  }
}

TEST(ThreadPool, WakesWorkersThatHaveGoneToSleep) {
  ThreadPool pool(3);
  for (int round = 0; round < 3; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    std::atomic<int> calls{0};
    pool.run(64, [&](std::size_t, unsigned) { ++calls; });
    EXPECT_EQ(calls, 64);
  }
}

TEST(ThreadPool, HandsOutWhatATaskThrows) {
  for (const unsigned threads : {1U, 4U}) {
    ThreadPool pool(threads);
    const auto fail = [](std::size_t index, unsigned) {
      if (index == 7) throw std::runtime_error("the seventh");
    };
    EXPECT_THROW(pool.run(20, fail), std::runtime_error) << threads;
    std::atomic<int> calls{0};
    pool.run(20, [&](std::size_t, unsigned) { ++calls; });
    EXPECT_EQ(calls, 20) << "the next round is whole";
  }
}

}  // namespace
}  // namespace ravencal::learn
