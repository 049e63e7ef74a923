// SPDX-License-Identifier: Apache-2.0
//
// What is thrown in a helper reaches whoever waits for it, and checks hold in every build.
#include "core/side_by_side.hpp"
#include "core/run_tasks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/require.hpp"
#include "core/result.hpp"
#include "core/run_tasks.hpp"

namespace ravencal::core {
namespace {

TEST(SideBySide, HandsOutWhatAHelperThrows) {
  const auto caller = std::this_thread::get_id();
  std::barrier all(4);
  std::atomic<int> ended{0};
  const auto work = [&] {
    all.arrive_and_wait();
    if (std::this_thread::get_id() != caller) throw std::bad_alloc();
    ++ended;
  };
  EXPECT_THROW(side_by_side(4, work), std::bad_alloc);
  EXPECT_EQ(ended, 1) << "the calling thread's share is done";
}

TEST(SideBySide, WaitsForItsHelpersWhereTheCallerThrows) {
  const auto caller = std::this_thread::get_id();
  std::barrier all(4);
  std::atomic<int> ended{0};
  const auto work = [&] {
    all.arrive_and_wait();
    if (std::this_thread::get_id() == caller) throw std::runtime_error("the caller");
    ++ended;
  };
  EXPECT_THROW(side_by_side(4, work), std::runtime_error);
  EXPECT_EQ(ended, 3);
}

TEST(SideBySide, DoesEverythingOnceWhereNothingIsThrown) {
  for (const std::size_t threads : {0U, 1U, 5U}) {
    std::atomic<int> next{0}, done{0};
    side_by_side(threads, [&] {
      while (next++ < 100) ++done;
    });
    EXPECT_EQ(done, 100) << threads;
  }
}

TEST(Result, SaysWhyThereIsNoValue) {
  Result<std::string> failed = data_error("x.csv: line 3 is empty");
  try {
    (void)failed.value();
    ADD_FAILURE() << "it has no value";
  } catch (const std::logic_error& error) {
    EXPECT_STREQ(error.what(), "x.csv: line 3 is empty");
  }
  EXPECT_THROW((void)*failed, std::logic_error);
  EXPECT_THROW((void)std::move(failed).value(), std::logic_error);
  EXPECT_THROW((void)Result<int>(1).error(), std::logic_error);
}

TEST(Require, ThrowsItsSentence) {
  EXPECT_NO_THROW(require(true, "never"));
  try {
    require(false, "a histogram needs a bin");
    ADD_FAILURE();
  } catch (const std::logic_error& error) {
    EXPECT_STREQ(error.what(), "a histogram needs a bin");
  }
}

TEST(RunTasks, FinishesEachOnceAndTellsTheShareOfAll) {
  for (const unsigned threads : {1U, 3U}) {
    std::vector<std::atomic<int>> runs(20);
    double last = 0.0;
    std::size_t finished = 0;
    const auto done = run_tasks(
        runs.size(), threads,
        [&](std::size_t i, const auto& report) -> Result<bool> {
          ++runs[i];
          return report(0.5);
        },
        [&](double share, std::size_t so_far, std::size_t i) {
          EXPECT_LT(i, runs.size());
          last = std::max(last, share);
          finished = std::max(finished, so_far);
          return true;
        });
    ASSERT_TRUE(done.ok());
    EXPECT_EQ(done->finished, runs.size());
    EXPECT_FALSE(done->interrupted);
    EXPECT_DOUBLE_EQ(last, 1.0);
    EXPECT_EQ(finished, runs.size());
    for (const auto& run : runs) EXPECT_EQ(run, 1);
  }
  const auto none = run_tasks(
      0, 2, [](std::size_t, const auto&) -> Result<bool> { return true; },
      [](double, std::size_t, std::size_t) { return true; });
  ASSERT_TRUE(none.ok());
  EXPECT_FALSE(none->interrupted);
}

TEST(RunTasks, StopsWhereItIsToldToAndKeepsWhatIsDone) {
  int runs = 0;
  const auto done = run_tasks(
      10, 1, [&](std::size_t, const auto& report) -> Result<bool> { return ++runs, report(0.5); },
      [](double share, std::size_t, std::size_t) { return share < 0.34; });
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(runs, 4);  // the fourth's half makes 0.35
  EXPECT_EQ(done->finished, 3U);
  EXPECT_TRUE(done->interrupted);
}

TEST(RunTasks, ReturnsTheFirstErrorAndStartsNoOther) {
  int runs = 0;
  const auto done = run_tasks(
      10, 1,
      [&](std::size_t i, const auto&) -> Result<bool> {
        ++runs;
        if (i == 2) return Error{ErrorCode::kData, "broken"};
        return true;
      },
      [](double, std::size_t, std::size_t) { return true; });
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().message, "broken");
  EXPECT_EQ(runs, 3);
}

}  // namespace
}  // namespace ravencal::core
