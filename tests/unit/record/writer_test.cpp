// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <thread>

#include "record/load.hpp"
#include "record/recording_file.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<Channel> two_channels() {
  return {{"jpos.elbow", "deg", Role::kJointEstimate, "elbow"},
          {"truth.elbow", "rad", Role::kJointTruth, "elbow"}};
}

/// The first column of the first row of a query, as the sqlite3 shell would show it.
std::string ask(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  sqlite3_open(path.c_str(), &database);
  sqlite3_busy_timeout(database, 600'000);
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);
  std::string answer = "nothing";
  if (sqlite3_step(statement) == SQLITE_ROW) {
    const unsigned char* text = sqlite3_column_text(statement, 0);
    answer = text == nullptr ? "NULL" : reinterpret_cast<const char*>(text);
  }
  sqlite3_finalize(statement);
  sqlite3_close(database);
  return answer;
}

TEST(RecordingWriter, StoresValuesInTheirOwnUnitAndReadsThemInSi) {
  const Scratch scratch;
  auto writer = RecordingWriter::create(scratch / "r.db", {{"robot", "RAVEN-II"}}, two_channels());
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  const double row[] = {90.0, 1.5};
  ASSERT_TRUE(writer->append(1000, row).ok());
  ASSERT_TRUE(writer->finish().ok());

  EXPECT_EQ(ask(scratch / "r.db", "SELECT \"jpos.elbow\" FROM sample"), "90.0");
  const auto read = read_recording(scratch / "r.db");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_NEAR(read->samples(0, 0), std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(read->samples(0, 1), 1.5);
  EXPECT_EQ(read->channels[0].unit, "rad");
  EXPECT_EQ(read->channels[0].role, Role::kJointEstimate);
  EXPECT_EQ(read->meta.at("robot"), "RAVEN-II");
  EXPECT_EQ(read->meta.at("format_version"), "1");
  EXPECT_EQ(read->calibratable_joints(), std::vector<std::string>{"elbow"});
}

TEST(RecordingWriter, StoresLostDataAsNullAndEventNeverAsAValue) {
  const Scratch scratch;
  auto writer = RecordingWriter::create(scratch / "r.db", {}, two_channels());
  const double row[] = {kNaN, 1.0};
  ASSERT_TRUE(writer->append(7, row).ok());
  ASSERT_TRUE(writer->append_event({7, "drop", "encoder 2"}).ok());
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ(ask(scratch / "r.db", "SELECT \"jpos.elbow\" FROM sample"), "NULL");
  EXPECT_EQ(ask(scratch / "r.db", "SELECT detail FROM event WHERE kind='drop'"), "encoder 2");
  const auto read = read_recording(scratch / "r.db");
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE(std::isnan(read->samples(0, 0)));
  ASSERT_EQ(read->events.size(), 1U);
  EXPECT_EQ(read->events[0].detail, "encoder 2");
}

TEST(RecordingWriter, LeavesOneFileInWalModeWhenFinished) {
  const Scratch scratch;
  auto writer = RecordingWriter::create(scratch / "r.db", {}, two_channels());
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ(scratch.file_count(), 1U);
  ASSERT_TRUE(read_recording(scratch / "r.db").ok());
  EXPECT_EQ(scratch.file_count(), 1U) << "reading must leave nothing behind";
  EXPECT_EQ(ask(scratch / "r.db", "PRAGMA journal_mode"), "wal");
}

/// What is made in a folder while this lives, by the end of the names: from the last dot on.
class MadeFiles {
 public:
  explicit MadeFiles(const std::filesystem::path& folder)
      : watch_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
    EXPECT_GE(::inotify_add_watch(watch_, folder.c_str(), IN_CREATE), 0);
  }
  ~MadeFiles() { ::close(watch_); }
  MadeFiles(const MadeFiles&) = delete;
  MadeFiles& operator=(const MadeFiles&) = delete;

  [[nodiscard]] std::set<std::string> endings() const {
    alignas(inotify_event) std::array<char, 65536> buffer{};
    const ssize_t size = ::read(watch_, buffer.data(), buffer.size());
    std::set<std::string> found;
    for (ssize_t at = 0; at < size;) {
      const auto* const made = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      found.insert(std::filesystem::path(made->name).extension().string());
      at += static_cast<ssize_t>(sizeof(inotify_event)) + made->len;
    }
    return found;
  }

 private:
  int watch_;
};

// A signal removes these three; another file beside them would stay.
TEST(RecordingWriter, MakesNoFileThatASignalWouldLeaveBehind) {
  const Scratch scratch;
  const MadeFiles made(scratch / "");
  auto writer = RecordingWriter::create_whole(scratch / "r.db", {}, two_channels());
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  const double row[] = {1.0, 2.0};
  ASSERT_TRUE(writer->append(1, row).ok());
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ(made.endings(), (std::set<std::string>{".partial", ".partial-wal", ".partial-shm"}));
}

TEST(RecordingWriter, IsReadableWhileItWritesAndAfterTheSourceFallsSilent) {
  const Scratch scratch;
  auto writer = RecordingWriter::create(scratch / "r.db", {}, two_channels());
  const double row[] = {1.0, 2.0};
  ASSERT_TRUE(writer->append(1, row).ok());
  // No further call: the writer commits by itself.
  while (ask(scratch / "r.db", "SELECT count(*) FROM sample") != "1")
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const auto read = read_recording(scratch / "r.db");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->rows(), 1);
  ASSERT_TRUE(writer->append(2, row).ok());
  EXPECT_TRUE(writer->finish().ok());
}

TEST(RecordingWriter, OneOfTwoThatCreateOneNameAtOnceOwnsIt) {
  for (int trial = 0; trial < 50; ++trial) {
    const Scratch scratch;
    std::atomic<int> ready = 0;
    std::atomic<int> created = 0;
    const auto create = [&](double value) {
      ++ready;
      while (ready < 2) std::this_thread::yield();
      auto writer = RecordingWriter::create(scratch / "r.db", {}, two_channels());
      if (!writer.ok()) {
        EXPECT_NE(writer.error().message.find("exists already"), std::string::npos)
            << writer.error().message;
        return;
      }
      ++created;
      const double row[] = {value, value};
      for (std::int64_t t_ns = 0; t_ns < 20; ++t_ns) EXPECT_TRUE(writer->append(t_ns, row).ok());
      EXPECT_TRUE(writer->finish().ok());
    };
    std::thread other(create, 1.0);
    create(2.0);
    other.join();
    ASSERT_EQ(created, 1);
    const auto read = read_recording(scratch / "r.db");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->rows(), 20);
    EXPECT_EQ(read->samples.col(1).minCoeff(), read->samples.col(1).maxCoeff());
    EXPECT_EQ(scratch.file_count(), 1U);
  }
}

TEST(RecordingWriter, RefusesWhatWouldBreakARecording) {
  const Scratch scratch;
  auto writer = RecordingWriter::create(scratch / "r.db", {}, two_channels());
  const double row[] = {1.0, 2.0};
  ASSERT_TRUE(writer->append(5, row).ok());
  EXPECT_FALSE(writer->append(4, row).ok()) << "time runs backwards";
  EXPECT_TRUE(writer->append(5, row).ok()) << "equal stamps are allowed";
  EXPECT_FALSE(writer->append(6, std::span(row, 1)).ok()) << "too few values";
  EXPECT_TRUE(writer->finish().ok());
  EXPECT_FALSE(writer->append(7, row).ok()) << "finished";
  EXPECT_FALSE(RecordingWriter::create(scratch / "r.db", {}, two_channels()).ok()) << "exists";
  EXPECT_TRUE(RecordingWriter::create(scratch / "r.db", {}, two_channels(), true).ok());
}

TEST(RecordingWriter, RefusesChannelsThatCannotBeColumns) {
  const Scratch scratch;
  const auto create = [&](std::vector<Channel> channels) {
    return RecordingWriter::create(scratch / "r.db", {}, channels).ok();
  };
  EXPECT_FALSE(create({{"a", "rad", Role::kFeature, ""}, {"A", "rad", Role::kFeature, ""}}));
  EXPECT_FALSE(create({{"t_ns", "s", Role::kFeature, ""}}));
  EXPECT_FALSE(create({{"", "s", Role::kFeature, ""}}));
  EXPECT_FALSE(create({{"a", "furlong", Role::kFeature, ""}}));
  EXPECT_FALSE(create(std::vector<Channel>(2000, {"a", "rad", Role::kFeature, ""})));
  EXPECT_EQ(scratch.file_count(), 0U);
  EXPECT_TRUE(create({{"it's \"odd\"; DROP TABLE sample", "rad", Role::kFeature, ""}}));
}

/// Somebody took rows out, or numbered them as no writer does.
TEST(RecordingReader, ReadsRowsHoweverTheyAreNumbered) {
  const auto times_after = [](const std::string& change) {
    const Scratch scratch;
    auto writer = RecordingWriter::create(scratch / "r.db", {}, two_channels());
    EXPECT_TRUE(writer.ok());
    const double row[] = {90.0, 1.5};
    for (const std::int64_t t_ns : {1000, 2000, 3000, 4000})
      EXPECT_TRUE(writer->append(t_ns, row).ok());
    EXPECT_TRUE(writer->finish().ok());
    ask(scratch / "r.db", change);
    const auto read = read_recording(scratch / "r.db");
    EXPECT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->samples.rows(), static_cast<Eigen::Index>(read->t_ns.size())) << change;
    EXPECT_TRUE((read->samples.col(1).array() == 1.5).all()) << change;
    return read->t_ns;
  };
  using Times = std::vector<std::int64_t>;
  EXPECT_EQ(times_after("DELETE FROM sample WHERE t_ns = 2000"), (Times{1000, 3000, 4000}));
  EXPECT_EQ(times_after("DELETE FROM sample WHERE t_ns = 4000"), (Times{1000, 2000, 3000}));
  EXPECT_EQ(times_after("UPDATE sample SET rowid = rowid - 9"), (Times{1000, 2000, 3000, 4000}));
  EXPECT_EQ(times_after("UPDATE sample SET rowid = 4611686018427387904 WHERE t_ns = 4000"),
            (Times{1000, 2000, 3000, 4000}));
  EXPECT_EQ(times_after("DELETE FROM sample"), Times{});
}

TEST(RecordingReader, NamesWhatIsWrongWithAFile) {
  const Scratch scratch;
  const auto error = [](const std::filesystem::path& path) {
    const auto read = read_recording(path);
    return read.ok() ? std::string("no error") : read.error().message;
  };
  EXPECT_NE(error(scratch / "none.db").find("no such file"), std::string::npos);
  EXPECT_NE(error(scratch.write("text.db", "not a database, but long enough to look like a file"))
                .find("not a database"),
            std::string::npos);
  EXPECT_NE(error(scratch.write("empty.db", "")).find("not a recording"), std::string::npos);
  ASSERT_TRUE(RecordingWriter::create(scratch / "new.db", {}, two_channels()).ok());
  ask(scratch / "new.db", "UPDATE meta SET value='9' WHERE key='format_version'");
  EXPECT_NE(error(scratch / "new.db").find("format '9'"), std::string::npos);
  ASSERT_TRUE(RecordingWriter::create(scratch / "text2.db", {}, two_channels()).ok());
  ask(scratch / "text2.db", "INSERT INTO sample VALUES(1, 'much', 2.0)");
  EXPECT_NE(error(scratch / "text2.db").find("'much' is not a number"), std::string::npos);
}

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
  const auto read = read_recording(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_GE(read->rows(), reports.back().flushed);
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
  const auto read = read_recording(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_GE(read->rows(), reports.back().flushed);
}

TEST(RecordingWriter, NoRowOfAKilledWriterOutlivesTheFileThatReplacesIt) {
  Recording whole;
  whole.channels = two_channels();
  whole.channels[0].unit = "rad";
  whole.t_ns = {-5};
  whole.samples = SampleMatrix::Constant(1, 2, 3.0);
  const Scratch scratch;
  const auto path = scratch / "r.db";
  for (const bool file_stays : {true, false}) {
    ASSERT_GT(run_and_kill(path, std::chrono::milliseconds(200)).size(), 1U);
    ASSERT_TRUE(std::filesystem::exists(path.string() + "-wal"));
    if (!file_stays) std::filesystem::remove(path);
    const core::Status written = write_recording(whole, path, file_stays);
    ASSERT_TRUE(written.ok()) << written.error().message;
    EXPECT_EQ(ask(path, "SELECT count(*) FROM sample"), "1");
    const auto read = read_recording(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->t_ns, whole.t_ns);
    EXPECT_EQ(scratch.file_count(), 1U);
    std::filesystem::remove(path);
  }
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
