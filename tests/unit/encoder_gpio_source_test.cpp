// SPDX-License-Identifier: Apache-2.0
//
// What both libgpiod backends share, with pipes for the kernel's queues.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "quadrature_reader/sources/gpio_source.hpp"

namespace ravencal::quadrature_reader {
namespace {

using std::chrono::milliseconds;

/// A queue is a pipe: each byte in it is an edge of line A of axis 0 at the time of its reading.
class PipeBackend final : public GpioBackend {
 public:
  PipeBackend() { EXPECT_EQ(::pipe(pipe_.data()), 0); }
  ~PipeBackend() override {
    unplug();
    ::close(pipe_[0]);
  }
  PipeBackend(const PipeBackend&) = delete;
  PipeBackend& operator=(const PipeBackend&) = delete;

  core::Result<std::vector<int>> open(const SourceSettings&) override {
    return std::vector<int>{pipe_[0]};
  }
  core::Status drain(std::size_t, EdgeSorter& sorter) override {
    char byte = 0;
    if (::read(pipe_[0], &byte, 1) == 1) {
      sorter.add_edge({monotonic_now_ns(), byte, 0, ReadingKind::kEdge, Line::kA, Fault::kNone});
    }
    return {};
  }
  core::Result<std::int64_t> read_levels(std::size_t) override {
    ++levels_read;
    return std::int64_t{3};
  }

  void edge() { EXPECT_EQ(::write(pipe_[1], "\1", 1), 1); }
  void unplug() {
    if (pipe_[1] >= 0) ::close(pipe_[1]);
    pipe_[1] = -1;
  }
  int levels_read = 0;

 private:
  std::array<int, 2> pipe_{};
};

struct Bench {
  explicit Bench(std::int64_t reorder_ns) {
    auto made = std::make_unique<PipeBackend>();
    backend = made.get();
    SourceSettings settings;
    settings.device = "/dev/ravencal/encoders";
    settings.reorder_ns = reorder_ns;
    settings.gpio.emplace_back();
    source = std::make_unique<GpioSource>(settings, std::move(made));
    EXPECT_TRUE(source->open().ok());
  }
  PipeBackend* backend;
  std::unique_ptr<GpioSource> source;
};

int count(const std::vector<Reading>& readings, ReadingKind kind) {
  return static_cast<int>(std::count_if(readings.begin(), readings.end(),
                                        [&](const auto& each) { return each.kind == kind; }));
}

TEST(GpioSource, ConfirmsTheLevelsAtTheStartAndThenRests) {
  Bench bench(1'000'000);
  std::vector<Reading> out;
  while (count(out, ReadingKind::kLevels) == 0) {
    ASSERT_TRUE(bench.source->read(out, milliseconds(10)).ok());
  }
  const int asked = bench.backend->levels_read;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(bench.source->read(out, milliseconds(1)).ok());
  EXPECT_LE(bench.backend->levels_read, asked + 1) << "once a second, no more";
}

TEST(GpioSource, DeliversWhatItHasReadWhenTheChipGoes) {
  Bench bench(100'000'000);  // edges are held back for longer than this test
  std::vector<Reading> out;
  bench.backend->edge();
  ASSERT_TRUE(bench.source->read(out, milliseconds(10)).ok());
  EXPECT_EQ(count(out, ReadingKind::kEdge), 0);
  bench.backend->unplug();
  const auto gone = bench.source->read(out, milliseconds(10));
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().code, core::ErrorCode::kDevice);
  EXPECT_NE(gone.error().message.find("/dev/ravencal/encoders is gone"), std::string::npos);
  EXPECT_EQ(count(out, ReadingKind::kEdge), 1);
}

TEST(GpioSource, AsksForTheLevelsAgainAfterALoss) {
  EdgeSorter sorter(1000);
  sorter.add_levels(0, 10'000, 0);
  std::vector<Reading> out;
  sorter.release(20'000, out);
  EXPECT_FALSE(sorter.wants_levels(0));
  sorter.add_loss(0, 30'000);
  EXPECT_TRUE(sorter.wants_levels(0));
}

}  // namespace
}  // namespace ravencal::quadrature_reader
