// SPDX-License-Identifier: Apache-2.0
//
// The thread that reads a device: what it passes on when the device fails, when nobody takes the
// readings, when it is told to stop. Run under ThreadSanitizer too.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "quadrature_reader/reader_thread.hpp"

namespace ravencal::quadrature_reader {
namespace {

/// A device whose open() and read() the test writes.
class ScriptedSource final : public Source {
 public:
  std::function<core::Status(int call)> on_open = [](int) { return core::Status(); };
  std::function<core::Status(int call, std::vector<Reading>& out)> on_read;
  std::atomic<bool> waits{false};
  std::atomic<bool> ended{false};

  core::Status open() override { return on_open(opens_++); }
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds) override {
    return on_read(reads_++, out);
  }
  [[nodiscard]] bool patient() const override { return waits; }
  [[nodiscard]] bool finished() const override { return ended; }

 private:
  int opens_ = 0;
  int reads_ = 0;
};

Reading count_of(std::int64_t value) {
  return {value, value, 0, ReadingKind::kCount, Line::kA, Fault::kNone};
}

core::Error unplugged() { return {core::ErrorCode::kDevice, "the chip is gone"}; }

std::vector<Reading> take_all(ReaderThread& thread) {
  std::vector<Reading> all;
  Reading reading;
  while (thread.ring().try_pop(reading)) all.push_back(reading);
  return all;
}

TEST(ReaderThread, TellsAFailureOnceAndTheReturn) {
  auto source = std::make_unique<ScriptedSource>();
  ScriptedSource* device = source.get();
  device->on_read = [device](int call, std::vector<Reading>& out) -> core::Status {
    out.push_back(count_of(call));
    if (call == 0) return unplugged();
    device->ended = true;
    return {};
  };
  ReaderThread thread(std::move(source), 64, 0);
  thread.start();
  while (!thread.finished()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  thread.stop();
  const auto all = take_all(thread);
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[0].kind, ReadingKind::kCount) << "what was read before the failure";
  EXPECT_EQ(all[1].kind, ReadingKind::kFault);
  EXPECT_EQ(all[1].fault, Fault::kDeviceGone);
  EXPECT_EQ(all[2].kind, ReadingKind::kRecovered);
  EXPECT_EQ(all[3].kind, ReadingKind::kCount);
  EXPECT_EQ(thread.last_error(), "the chip is gone");
}

TEST(ReaderThread, StopsAtOnceWhileTheDeviceIsMissing) {
  auto source = std::make_unique<ScriptedSource>();
  source->on_read = [](int, std::vector<Reading>&) -> core::Status { return unplugged(); };
  std::atomic<bool> tried_again{false};
  source->on_open = [&](int) -> core::Status {
    tried_again = true;
    return unplugged();
  };
  ReaderThread thread(std::move(source), 64, 0);
  thread.start();
  while (!tried_again) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  thread.stop();
  EXPECT_FALSE(thread.finished());
  EXPECT_EQ(take_all(thread).size(), 1U) << "one fault, however often the device is tried";
}

TEST(ReaderThread, CountsWhatFindsTheRingFullAndSaysSoWhenThereIsRoom) {
  constexpr int kReadings = 1000;
  auto source = std::make_unique<ScriptedSource>();
  std::atomic<int> delivered{0};
  std::atomic<bool> go_on{false};
  source->on_read = [&](int call, std::vector<Reading>& out) -> core::Status {
    if (call >= kReadings && !go_on) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return {};
    }
    out.push_back(count_of(call));
    ++delivered;
    return {};
  };
  ReaderThread thread(std::move(source), 16, 0);
  thread.start();
  while (delivered < kReadings) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto first = take_all(thread);
  EXPECT_EQ(first.size(), 16U) << "the oldest are kept";
  go_on = true;
  std::vector<Reading> later;
  while (later.size() < 2) {
    const auto more = take_all(thread);
    later.insert(later.end(), more.begin(), more.end());
  }
  thread.stop();
  EXPECT_EQ(later[0].kind, ReadingKind::kLost);
  EXPECT_EQ(later[0].fault, Fault::kRingOverflow);
  EXPECT_EQ(later[0].axis, kEveryAxis);
}

TEST(ReaderThread, KeepsAPatientSourceWaitingAndLosesNothing) {
  constexpr int kReadings = 20'000;
  auto source = std::make_unique<ScriptedSource>();
  ScriptedSource* recording = source.get();
  recording->waits = true;
  recording->on_read = [recording](int call, std::vector<Reading>& out) -> core::Status {
    out.push_back(count_of(call));
    if (call + 1 == kReadings) recording->ended = true;
    return {};
  };
  ReaderThread thread(std::move(source), 16, 0);
  thread.start();
  std::int64_t next = 0;
  while (next < kReadings) {
    for (const auto& reading : take_all(thread)) ASSERT_EQ(reading.value, next++);
  }
  EXPECT_TRUE(thread.last_error().empty());
}

}  // namespace
}  // namespace ravencal::quadrature_reader
