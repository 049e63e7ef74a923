// SPDX-License-Identifier: Apache-2.0
//
// What is thrown in a helper reaches whoever waits for it, and checks hold in every build.
#include "core/side_by_side.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <new>
#include <stdexcept>
#include <string>

#include "core/require.hpp"
#include "core/result.hpp"

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

}  // namespace
}  // namespace ravencal::core
