// SPDX-License-Identifier: Apache-2.0
#include "core/isolated.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "core/json_text.hpp"
#include "core/side_by_side.hpp"

namespace ravencal::core {
namespace {

// A sanitizer reserves terabytes of addresses, so that there is no bound on memory.
#ifdef RAVENCAL_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

using Piece = std::span<const std::uint8_t>;

Piece piece_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string said(const Isolation& bounds, const std::function<Status(const TakePiece&)>& work,
                 const TakePiece& take = {}) {
  const Status status = in_child("x.bag", "read", bounds, work, take);
  return status.ok() ? "ok" : status.error().message;
}

TEST(InChild, GivesThePiecesInOrderAndTheWorksOwnError) {
  std::string got;
  const auto take = [&](Piece piece) -> Status {
    got.append(piece.begin(), piece.end());
    return {};
  };
  const auto work = [](const TakePiece& send) -> Status {
    for (const char* text : {"one ", "", "two "}) RAVENCAL_RETURN_IF_ERROR(send(piece_of(text)));
    return send(piece_of(std::string(1'000'000, '.')));
  };
  EXPECT_EQ(said({}, work, take), "ok");
  EXPECT_EQ(got, "one two " + std::string(1'000'000, '.'));
  const Status failed = in_child("x.bag", "read", {}, [](const TakePiece&) -> Status {
    return device_error("x.bag: this is what I found");
  });
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::kDevice);
  EXPECT_EQ(failed.error().message, "x.bag: this is what I found");
}

TEST(InChild, OutlivesACrashAndSaysSo) {
  const auto crash = [](const TakePiece&) -> Status {
    std::signal(SIGSEGV, SIG_DFL);
    ::raise(SIGSEGV);
    return {};
  };
  EXPECT_EQ(said({}, crash), "x.bag: cannot be read: its library failed (Segmentation fault)");
  const auto abort = [](const TakePiece&) -> Status { std::abort(); };
  EXPECT_EQ(said({}, abort), "x.bag: cannot be read: its library failed (Aborted)");
  const auto thrown = [](const TakePiece&) -> Status { throw std::runtime_error("a bad word"); };
  EXPECT_EQ(said({}, thrown), "x.bag: cannot be read: a bad word");
  const auto left = [](const TakePiece&) -> Status { ::_exit(5); };
  EXPECT_EQ(said({}, left), "x.bag: cannot be read: its library ended the process (5)");
}

TEST(InChild, EndsWorkThatFindsNoEnd) {
  const auto endless = [](const TakePiece&) -> Status {
    std::atomic<std::uint64_t> turns{0};
    for (;;) {
      turns.fetch_add(1, std::memory_order_relaxed);
    }
  };
  EXPECT_EQ(said({.cpu_s = 1}, endless),
            "x.bag: cannot be read: it was not done after 1 s of processor time");
  const auto waiting = [](const TakePiece&) -> Status {
    for (;;) ::pause();
  };
  EXPECT_EQ(said({.wall_s = 1}, waiting), "x.bag: cannot be read: it was not done after 1 s");
}

TEST(InChild, EndsWorkThatAsksForTooMuchMemoryOrSendsTooMuch) {
  const auto greedy = [](const TakePiece&) -> Status {
    const std::vector<char> bytes(std::size_t{1} << 30U, 'x');
    return bytes.back() == 'x' ? Status() : data_error("lost");
  };
  if (!kSanitized) {
    EXPECT_EQ(said({.memory_bytes = 64U << 20U}, greedy),
              "x.bag: cannot be read: it asks for more than 64 MiB of memory");
  }
  const auto endless = [](const TakePiece& send) -> Status {
    while (send(piece_of("again and again")).ok()) {
    }
    return {};
  };
  EXPECT_EQ(said({.sent_bytes = 100'000}, endless),
            "x.bag: cannot be read: it holds far more than a file of its size can");
}

TEST(InChild, EndsTheWorkWhereItsPiecesAreRefused) {
  const auto endless = [](const TakePiece& send) -> Status {
    while (send(piece_of("again and again")).ok()) {
    }
    return {};
  };
  EXPECT_EQ(said({}, endless, [](Piece) -> Status { return data_error("I take no more"); }),
            "I take no more");
}

TEST(SideBySide, DoesAllTheWorkWhereTheSystemGivesNoThreads) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer reserves more memory than can be left";
  const auto counted = [] {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const std::uint64_t now = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    // A thread's stack needs 8 MiB.
    const struct rlimit limit = {now + (4U << 20U), now + (4U << 20U)};
    (void)::setrlimit(RLIMIT_AS, &limit);
    std::atomic<int> next{0};
    std::atomic<int> done{0};
    side_by_side(8, [&] {
      while (next++ < 100) ++done;
    });
    return done.load();
  };
  EXPECT_EXIT(std::exit(counted() == 100 ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(JsonText, RefusesWhatNestsTooDeep) {
  EXPECT_TRUE(parse_json(std::string(60, '[') + std::string(60, ']')).ok());
  const auto deep = parse_json(std::string(100'000, '[') + std::string(100'000, ']'));
  ASSERT_FALSE(deep.ok());
  EXPECT_EQ(deep.error().message, "nests JSON more than 64 deep");
  const auto broken = parse_json("{\"a\": ");
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().message, "is not JSON");
}

}  // namespace
}  // namespace ravencal::core
