// SPDX-License-Identifier: Apache-2.0
//
// Counter chips, with files in place of sysfs and a pipe that is fed the kernel's own structures
// in place of /dev/counterN. tests/vm has the kernel's counter subsystem itself.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <linux/counter.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "quadrature_reader/sources/counter.hpp"

namespace ravencal::quadrature_reader {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

/// A counter whose driver reports changes of state.
class ReportingSource final : public CounterSource {
 public:
  using CounterSource::CounterSource;

 protected:
  core::Result<bool> enable_events() override { return true; }
};

class CounterTest : public testing::Test {
 protected:
  CounterTest() : folder_(fs::temp_directory_path() / fmt::format("counter_{}", ::getpid())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "sys/counter0/count0");
    EXPECT_EQ(::mkfifo(device().c_str(), 0600), 0);
    writer_ = ::open(device().c_str(), O_RDWR | O_CLOEXEC);
    put("function", "quadrature x4");
    put("ceiling", "65535");
    put("count", "100");
    settings_.kind = SourceKind::kCounter;
    settings_.device = device();
    settings_.counters.push_back({3, 0, 0, 0, 100'000.0});
  }
  ~CounterTest() override {
    ::close(writer_);
    fs::remove_all(folder_);
  }

  [[nodiscard]] fs::path device() const { return folder_ / "counter0"; }
  [[nodiscard]] fs::path sysfs() const { return folder_ / "sys"; }
  void put(const char* name, const std::string& text) const {
    std::ofstream(sysfs() / "counter0/count0" / name) << text << '\n';
  }
  void event(std::uint64_t value) const {
    counter_event event{};
    event.timestamp = static_cast<std::uint64_t>(monotonic_now_ns());
    event.value = value;
    event.watch.component.type = COUNTER_COMPONENT_COUNT;
    event.watch.event = COUNTER_EVENT_CHANGE_OF_STATE;
    ASSERT_EQ(::write(writer_, &event, sizeof(event)), static_cast<ssize_t>(sizeof(event)));
  }
  static std::vector<Reading> read_for(Source& source, milliseconds time) {
    std::vector<Reading> all;
    const std::int64_t until = monotonic_now_ns() + std::chrono::nanoseconds(time).count();
    while (monotonic_now_ns() < until) {
      std::vector<Reading> out;
      EXPECT_TRUE(source.read(out, milliseconds(10)).ok());
      EXPECT_EQ(out.back().kind, ReadingKind::kAlive);
      out.pop_back();
      all.insert(all.end(), out.begin(), out.end());
    }
    return all;
  }

  fs::path folder_;
  SourceSettings settings_;
  int writer_ = -1;
};

TEST_F(CounterTest, AsksAChipThatReportsNothing) {
  CounterSource source(settings_, sysfs());
  ASSERT_TRUE(source.open().ok());
  auto readings = read_for(source, milliseconds(20));
  ASSERT_GE(readings.size(), 2U);
  EXPECT_EQ(readings[0].kind, ReadingKind::kCount);
  EXPECT_EQ(readings[0].value, 100);
  EXPECT_EQ(readings[0].axis, 3);
  put("count", "65436");  // backwards through the wrap that the ceiling tells
  readings = read_for(source, milliseconds(20));
  EXPECT_EQ(readings.back().value, -100);
}

TEST_F(CounterTest, TakesCountAndTimeOfEveryReportedChange) {
  ReportingSource source(settings_, sysfs());
  ASSERT_TRUE(source.open().ok());
  ASSERT_EQ(read_for(source, milliseconds(5)).size(), 1U) << "where it stands at the start";
  put("count", "102");
  event(101);
  event(102);
  const auto readings = read_for(source, milliseconds(250));
  ASSERT_EQ(readings.size(), 2U) << "a count that agrees with the last event is not told again";
  EXPECT_EQ(readings[0].value, 101);
  EXPECT_EQ(readings[1].value, 102);
  EXPECT_LE(readings[0].t_ns, readings[1].t_ns);
}

TEST_F(CounterTest, FindsOutThatTheKernelDroppedTheLastEvents) {
  ReportingSource source(settings_, sysfs());
  ASSERT_TRUE(source.open().ok());
  read_for(source, milliseconds(5));
  event(101);
  put("count", "150");
  const auto readings = read_for(source, milliseconds(350));
  ASSERT_EQ(readings.size(), 3U);
  EXPECT_EQ(readings[1].kind, ReadingKind::kLost);
  EXPECT_EQ(readings[1].fault, Fault::kQueueOverflow);
  EXPECT_EQ(readings[2].value, 150);
}

TEST_F(CounterTest, MakesAnImpossibleCountAnEventAndNotAJump) {
  CounterSource source(settings_, sysfs());
  ASSERT_TRUE(source.open().ok());
  read_for(source, milliseconds(5));
  put("count", "30000");
  std::vector<Reading> out;
  while (out.size() < 2) ASSERT_TRUE(source.read(out, milliseconds(1)).ok());
  EXPECT_EQ(out[0].kind, ReadingKind::kLost);
  EXPECT_EQ(out[0].fault, Fault::kImplausibleCount);
}

TEST_F(CounterTest, NamesDeviceAndRemedyOfWhatDoesNotFit) {
  const auto refusal = [&] {
    CounterSource source(settings_, sysfs());
    const auto status = source.open();
    return status.ok() ? std::string() : status.error().message;
  };
  put("ceiling", "79999");
  EXPECT_NE(refusal().find("echo 4294967295 >"), std::string::npos);
  put("ceiling", "65535");
  put("function", "increase");
  EXPECT_NE(refusal().find("quadrature x4"), std::string::npos);
  put("function", "quadrature x4");
  settings_.counter_mode = CounterMode::kEvents;
  EXPECT_NE(refusal().find("mode = \"poll\""), std::string::npos);
  settings_.counters[0].number = 7;
  EXPECT_NE(refusal().find("has no count7"), std::string::npos);
  settings_.device = (folder_ / "counter9").string();
  EXPECT_NE(refusal().find("counter9: cannot be opened"), std::string::npos);
}

TEST_F(CounterTest, SaysSoWhenTheChipGoes) {
  CounterSource source(settings_, sysfs());
  ASSERT_TRUE(source.open().ok());
  read_for(source, milliseconds(5));
  std::ofstream(sysfs() / "counter0/count0/count").flush();  // empty, as nothing is read any more
  std::vector<Reading> out;
  core::Status status;
  for (int i = 0; i < 50 && status.ok(); ++i) status = source.read(out, milliseconds(10));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kDevice);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
