// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <thread>

#include "record/load.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"
#include "small_recording.hpp"

namespace ravencal::record {
namespace {

using testing::ask;
using testing::Scratch;
using testing::two_channels;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

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

// A signal removes the folder; what lies beside it would stay.
TEST(RecordingWriter, MakesNoFileThatASignalWouldLeaveBehind) {
  const Scratch scratch;
  const MadeFiles made(scratch / "");
  auto writer = RecordingWriter::create_whole(scratch / "r.db", {}, two_channels());
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  const double row[] = {1.0, 2.0};
  ASSERT_TRUE(writer->append(1, row).ok());
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ(made.endings(), (std::set<std::string>{".partial"}));
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
        // Who comes between the other's look and its first byte finds the file locked.
        const std::string& why = writer.error().message;
        EXPECT_TRUE(why.find("exists already") != std::string::npos ||
                    why.find("another process writes") != std::string::npos)
            << why;
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

}  // namespace
}  // namespace ravencal::record
