// SPDX-License-Identifier: Apache-2.0
//
// What stays of a recording when the program is killed, or the disk is full.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <random>
#include <thread>

#include "core/constants.hpp"
#include "quadrature_reader/recorder.hpp"
#include "quadrature_reader/sources/source.hpp"
#include "record/load.hpp"

namespace ravencal::quadrature_reader {
namespace {

namespace fs = std::filesystem;

class Scratch {
 public:
  Scratch() : path_(fs::temp_directory_path() / ("encoder_failure_" + std::to_string(::getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

Config one_joint() {
  Config config;
  config.sources.emplace_back();
  EncoderSettings encoder;
  encoder.axis.joint = "shoulder";
  encoder.axis.si_per_count = 1e-4;
  encoder.axis.zero_counts = 0;
  encoder.axis.stale_ns = 1'000'000'000;
  encoder.axis.latency_ns = 2 * core::kNsPerMs;
  config.encoders.push_back(encoder);
  return config;
}

void feed(Recorder& recorder, std::int64_t t_ns, std::int64_t count) {
  recorder.take(0, {t_ns, count, 0, ReadingKind::kCount, Line::kA, Fault::kNone});
  recorder.take(0, {t_ns, 0, kEveryAxis, ReadingKind::kAlive, Line::kA, Fault::kNone});
  recorder.write_due();
}

/// Rows that the recorder handed over, seen from the other process.
struct Progress {
  std::atomic<std::int64_t> first_ns{0};
  std::atomic<std::int64_t> last_ns{0};
};

/// The recorder as it runs live, until somebody kills the process.
[[noreturn]] void record_until_killed(const fs::path& path, Progress& progress) {
  auto recorder = Recorder::create(one_joint(), path, {});
  if (!recorder.ok()) ::_exit(1);
  recorder->set_row_observer([&](std::int64_t t_ns, std::span<const AxisSample>) {
    if (progress.first_ns == 0) progress.first_ns = t_ns;
    progress.last_ns = t_ns;
  });
  for (std::int64_t count = 0;; ++count) {
    feed(*recorder, monotonic_now_ns(), count);
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
}

Eigen::Index rows_in(const fs::path& path) {
  const auto recording = record::load_recording(path, {});
  return recording.ok() ? recording->rows() : 0;
}

TEST(EncoderFailure, AKillAtAnyOf200MomentsLeavesAFileThatLacksTheLastMomentOnly) {
  const Scratch scratch;
  auto* shared =
      ::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  auto& progress = *new (shared) Progress;
  std::mt19937 generator(1);
  std::uniform_int_distribution<int> moment_us(0, 120'000);
  std::vector<std::int64_t> lacking_ns;
  for (int kill_number = 0; kill_number < 200; ++kill_number) {
    const fs::path path = scratch / ("kill" + std::to_string(kill_number) + ".db");
    progress.first_ns = progress.last_ns = 0;
    const pid_t child = ::fork();
    if (child == 0) record_until_killed(path, progress);
    ASSERT_GT(child, 0);
    while (progress.last_ns == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::microseconds(moment_us(generator)));
    // However long it takes on a busy machine, the rows get into the file while it is written.
    const bool waits = kill_number % 10 == 0;
    while (waits && rows_in(path) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto recording = record::load_recording(path, {});
    ASSERT_TRUE(recording.ok()) << kill_number << ": " << recording.error().message;
    EXPECT_TRUE(recording->rows() > 0 || !waits) << kill_number;
    std::int64_t kept_ns = progress.first_ns;
    if (recording->rows() > 0) {
      EXPECT_EQ(recording->t_ns.front(), progress.first_ns) << kill_number;
      kept_ns = recording->t_ns.back();
    }
    EXPECT_LE(kept_ns, progress.last_ns) << kill_number;
    lacking_ns.push_back(progress.last_ns - kept_ns);
    fs::remove(path);
    fs::remove(path.string() + "-wal");
    fs::remove(path.string() + "-shm");
  }
  ::munmap(shared, sizeof(Progress));
  const std::int64_t worst = *std::max_element(lacking_ns.begin(), lacking_ns.end());
  std::printf("200 kills: every file opens; at most %.1f ms of rows missing\n",
              1e-6 * static_cast<double>(worst));
  // The contract is 100 ms, which a test on a shared machine can measure and not judge.
}

/// No file may grow beyond `bytes`, as on a full disk, while this lives.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    (void)std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(EncoderFailure, AFullDiskCostsRowsAndAnEventButNotTheRun) {
  const Scratch scratch;
  auto recorder = Recorder::create(one_joint(), scratch / "r.db", {});
  ASSERT_TRUE(recorder.ok());
  std::int64_t t_ns = core::kNsPerMs;
  std::int64_t count = 0;
  {
    const SmallDisk disk(400'000);
    for (int i = 0; i < 200'000 && !recorder->sink().lost_rows(); ++i)
      feed(*recorder, t_ns += core::kNsPerMs, ++count);
    ASSERT_TRUE(recorder->sink().lost_rows());
    for (int i = 0; i < 1000; ++i) feed(*recorder, t_ns += core::kNsPerMs, ++count);
    EXPECT_EQ(recorder->axes()[0].count(), count) << "counting goes on";
  }
  recorder->sink().maintain(t_ns);
  for (int i = 0; i < 1000; ++i) feed(*recorder, t_ns += core::kNsPerMs, ++count);
  EXPECT_TRUE(recorder->finish().ok());
  const auto first = record::load_recording(scratch / "r.db", {});
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto rest = record::load_recording(scratch / "r.2.db", {});
  ASSERT_TRUE(rest.ok()) << rest.error().message;
  EXPECT_GT(rest->rows(), 990);
  ASSERT_FALSE(rest->events.empty());
  EXPECT_EQ(rest->events.front().kind, "gap");
  EXPECT_EQ(rest->samples(rest->rows() - 1, *rest->column("shoulder.counts")),
            static_cast<double>(count));
}

}  // namespace
}  // namespace ravencal::quadrature_reader
