// SPDX-License-Identifier: Apache-2.0
//
// A recording whose writer was killed, and what takes its name afterwards.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "record/recording_file.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"
#include "small_recording.hpp"

namespace ravencal::record {
namespace {

using testing::ask;
using testing::Scratch;
using testing::two_channels;

/// What the child tells its parent after each row.
struct Progress {
  std::int64_t row = 0;      ///< number of the row, also its stamp
  std::int64_t flushed = 0;  ///< the last row before a flush() that returned
  std::int64_t now_ns = 0;
};

std::int64_t now_ns() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Writes a row per millisecond, flushes now and then, and reports, until killed.
[[noreturn]] void write_until_killed(const std::filesystem::path& path, int pipe_end) {
  constexpr std::int64_t kFlushEvery = 97;
  auto writer = RecordingWriter::create(path, {}, two_channels());
  const double row[] = {0.25, 0.25};
  const auto start = std::chrono::steady_clock::now();
  Progress progress;
  for (progress.row = 1; writer.ok(); ++progress.row) {
    std::this_thread::sleep_until(start + std::chrono::milliseconds(progress.row));
    if (!writer->append(progress.row, row).ok()) break;
    if (progress.row % kFlushEvery == 0 && writer->flush().ok()) progress.flushed = progress.row;
    progress.now_ns = now_ns();
    if (::write(pipe_end, &progress, sizeof(progress)) != sizeof(progress)) break;
  }
  ::_exit(1);
}

/// What the writer reported; `meanwhile` happens while it writes.
std::vector<Progress> run_and_kill(const std::filesystem::path& path,
                                   std::chrono::milliseconds delay,
                                   const std::function<void()>& meanwhile = {}) {
  int pipe_ends[2];
  if (::pipe(pipe_ends) != 0) return {};
  const pid_t child = ::fork();
  if (child == 0) write_until_killed(path, pipe_ends[1]);
  ::close(pipe_ends[1]);
  std::vector<Progress> reports(1);
  const auto next = [&] {
    return ::read(pipe_ends[0], &reports.emplace_back(), sizeof(Progress)) == sizeof(Progress);
  };
  next();  // however slow the machine, the child has begun
  std::this_thread::sleep_for(delay);
  if (meanwhile) meanwhile();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  while (next()) {
  }
  reports.pop_back();
  ::close(pipe_ends[0]);
  return reports;
}

void expect_flushed_rows(const std::filesystem::path& path, const std::vector<Progress>& reports) {
  const auto read = read_recording(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_GE(read->rows(), reports.back().flushed);
}

TEST(RecordingWriter, KeepsTheRowsOfAKilledWriterUntilTheNewFileStands) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  const auto reports = run_and_kill(path, std::chrono::milliseconds(300));
  ASSERT_GT(reports.size(), 1U);
  ASSERT_TRUE(std::filesystem::exists(path.string() + "-wal"));
  // What a kill between this and the new file's arrival leaves.
  const core::Status settled = settle_recording(path);
  ASSERT_TRUE(settled.ok()) << settled.error().message;
  EXPECT_EQ(scratch.file_count(), 1U);
  expect_flushed_rows(path, reports);
}

/// While one lives, this process can write no file beyond `bytes`.
class FullDisk {
 public:
  explicit FullDisk(std::uintmax_t bytes) : ignored_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const struct rlimit limit = {bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, ignored_);
  }

 private:
  struct rlimit before_ = {};
  sighandler_t ignored_;
};

TEST(RecordingWriter, KeepsTheRowsOfAKilledWriterThatFindNoRoomInTheRecording) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  const auto reports = run_and_kill(path, std::chrono::milliseconds(300));
  ASSERT_GT(reports.size(), 1U);
  {
    const FullDisk disk(std::filesystem::file_size(path));
    const core::Status settled = settle_recording(path);
    ASSERT_FALSE(settled.ok());
    EXPECT_NE(settled.error().message.find("killed writer"), std::string::npos)
        << settled.error().message;
  }
  expect_flushed_rows(path, reports);
}

TEST(RecordingWriter, RefusesToReplaceARecordingThatAnotherProcessWrites) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  Recording other;
  other.channels = two_channels();
  const auto reports = run_and_kill(path, std::chrono::milliseconds(200), [&] {
    const core::Status whole = write_recording(other, path, true);
    ASSERT_FALSE(whole.ok());
    EXPECT_NE(whole.error().message.find("another process"), std::string::npos);
    const auto live = RecordingWriter::create(path, {}, two_channels(), true);
    ASSERT_FALSE(live.ok());
    EXPECT_NE(live.error().message.find("another process"), std::string::npos);
  });
  ASSERT_GT(reports.size(), 1U);
  expect_flushed_rows(path, reports);
}

TEST(RecordingWriter, NoRowOfAKilledWriterOutlivesTheFileThatReplacesIt) {
  Recording whole;
  whole.channels = two_channels();
  whole.channels[0].unit = "rad";
  whole.t_ns = {-5};
  whole.samples = SampleMatrix::Constant(1, 2, 3.0);
  const Scratch scratch;
  const auto path = scratch / "r.db";
  ASSERT_GT(run_and_kill(path, std::chrono::milliseconds(200)).size(), 1U);
  ASSERT_TRUE(std::filesystem::exists(path.string() + "-wal"));
  const core::Status written = write_recording(whole, path, true);
  ASSERT_TRUE(written.ok()) << written.error().message;
  EXPECT_EQ(ask(path, "SELECT count(*) FROM sample"), "1");
  const auto read = read_recording(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->t_ns, whole.t_ns);
  EXPECT_EQ(scratch.file_count(), 1U);
}

TEST(UnfinishedRecording, SaysThatItsLogIsMissing) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  const auto reports = run_and_kill(path, std::chrono::milliseconds(200));
  ASSERT_GT(reports.size(), 1U);
  expect_flushed_rows(path, reports);
  std::filesystem::remove(path.string() + "-shm");
  std::filesystem::rename(path.string() + "-wal", path.string() + "-log");
  const auto refused = read_recording(path);
  ASSERT_FALSE(refused.ok()) << refused->rows() << " rows";
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
  for (const char* words :
       {"not finished", "r.db-wal is missing", "rows can be read", "--skip-bad"})
    EXPECT_NE(refused.error().message.find(words), std::string::npos) << refused.error().message;
  const auto rest = read_recording(path, {}, 0, true);
  ASSERT_TRUE(rest.ok()) << rest.error().message;
  ASSERT_EQ(rest->events.size(), 1U);
  EXPECT_EQ(rest->events[0].kind, "drop");
  std::filesystem::rename(path.string() + "-log", path.string() + "-wal");
  expect_flushed_rows(path, reports);
}

TEST(UnfinishedRecording, IsFinishedByItsWriterAloneAndBeforeThatWasSaid) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  constexpr const char* kMark = "SELECT value FROM meta WHERE key = 'finished'";
  {
    auto writer = RecordingWriter::create(path, {}, two_channels());
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    EXPECT_EQ(ask(path, kMark), "0");
    EXPECT_TRUE(read_recording(path).ok()) << "while it is written";
    ASSERT_TRUE(writer->finish().ok());
  }
  EXPECT_EQ(ask(path, kMark), "1");
  const auto read = read_recording(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_FALSE(read->meta.contains("finished"));
  ASSERT_TRUE(write_recording(*read, scratch / "whole.db").ok());
  EXPECT_EQ(ask(scratch / "whole.db", kMark), "1");
  (void)ask(path, "DELETE FROM meta WHERE key = 'finished'");
  EXPECT_TRUE(read_recording(path).ok()) << "as earlier versions wrote it";
}

TEST(UnfinishedRecording, ItsLogIsNeverRemovedWithoutIt) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  const auto reports = run_and_kill(path, std::chrono::milliseconds(200));
  ASSERT_GT(reports.size(), 1U);
  std::filesystem::rename(path, scratch / "moved.db");
  for (const bool overwrite : {false, true}) {
    const core::Status whole = write_recording({}, path, overwrite);
    ASSERT_FALSE(whole.ok());
    EXPECT_EQ(whole.error().code, core::ErrorCode::kUsage);
    EXPECT_NE(whole.error().message.find("r.db-wal"), std::string::npos) << whole.error().message;
    EXPECT_FALSE(RecordingWriter::create(path, {}, two_channels(), overwrite).ok());
    EXPECT_FALSE(settle_recording(path).ok());
  }
  std::filesystem::rename(scratch / "moved.db", path);
  expect_flushed_rows(path, reports);
}

// How much a kill may cost is a matter of time, which no test on a shared machine can judge; it is
// measured and reported. What is judged: the file is whole, its rows are the first ones without a
// gap, and nothing is lost that was flushed.
TEST(RecordingWriter, LosesNothingThatWasCommittedWhenKilled) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> delay_ms(50, 350);
  std::int64_t most_lost_ns = 0;
  for (int trial = 0; trial < 8; ++trial) {
    const Scratch scratch;
    const auto reports =
        run_and_kill(scratch / "r.db", std::chrono::milliseconds(delay_ms(random)));
    ASSERT_GT(reports.size(), 1U);
    const auto read = read_recording(scratch / "r.db");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(ask(scratch / "r.db", "PRAGMA integrity_check"), "ok");
    const auto rows = static_cast<std::size_t>(read->rows());
    EXPECT_GE(static_cast<std::int64_t>(rows), reports.back().flushed);
    for (std::size_t r = 0; r < rows; ++r)
      EXPECT_EQ(read->t_ns[r], static_cast<std::int64_t>(r + 1));
    EXPECT_EQ((read->samples.col(1).array() == 0.25).count(), read->rows());
    if (rows == 0 || rows >= reports.size()) continue;
    most_lost_ns = std::max(most_lost_ns, reports.back().now_ns - reports[rows].now_ns);
  }
  std::printf("longest stretch lost to a kill: %.0f ms\n",
              static_cast<double>(most_lost_ns) * 1e-6);
}

}  // namespace
}  // namespace ravencal::record
