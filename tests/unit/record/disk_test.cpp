// SPDX-License-Identifier: Apache-2.0
//
// Behaviour on a full or unwritable disk.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <functional>

#include "record/csv_export.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

Recording large_recording() {
  Recording recording;
  for (int c = 0; c < 10; ++c) {
    recording.channels.push_back({"c" + std::to_string(c), "rad", Role::kFeature, ""});
  }
  recording.samples = SampleMatrix::Constant(5000, 10, 0.123456789);
  for (int r = 0; r < 5000; ++r) recording.t_ns.push_back(r);
  return recording;
}

/// Runs `action` in a child whose files may not grow beyond 64 KiB; true if it returned true.
bool with_full_disk(const std::function<bool()>& action) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{65536, 65536};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::_exit(action() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool says(const core::Status& status, std::string_view word) {
  if (status.ok()) return false;
  return status.error().code == core::ErrorCode::kIo &&
         status.error().message.find(word) != std::string::npos;
}

TEST(FullDisk, LeavesNothingOfAWholeRecording) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  EXPECT_TRUE(with_full_disk(
      [&] { return says(write_recording(large_recording(), path), path.string()); }));
  EXPECT_EQ(scratch.file_count(), 0U);
}

TEST(FullDisk, LeavesNothingOfAnExport) {
  const Scratch scratch;
  const auto path = scratch / "r.csv";
  const auto profile = load_profile("generic");
  ASSERT_TRUE(profile.ok());
  EXPECT_TRUE(with_full_disk(
      [&] { return says(export_csv(large_recording(), *profile, path), "File too large"); }));
  EXPECT_EQ(scratch.file_count(), 0U);
}

TEST(FullDisk, KeepsWhatALiveRecordingHadCommitted) {
  const Scratch scratch;
  const auto path = scratch / "r.db";
  EXPECT_TRUE(with_full_disk([&] {
    const Recording source = large_recording();
    auto writer = RecordingWriter::create(path, {}, source.channels);
    if (!writer.ok()) return false;
    const std::vector<double> row(10, 0.5);
    for (std::int64_t t = 0; t < 100000; ++t) {
      if (!writer->append(t, row).ok()) return true;
      if (t % 50 != 0) continue;
      if (const core::Status status = writer->flush(); !status.ok()) {
        return says(status, path.string()) && !writer->append(t, row).ok() &&
               !writer->finish().ok();
      }
    }
    return false;
  }));
  const auto read = read_recording(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_GT(read->rows(), 0);
  EXPECT_EQ((read->samples.array() == 0.5).count(), read->samples.size());
}

// Root may write anywhere, hence a folder in the way and a place where no file can be.
TEST(Permission, IsAskedForWithTheNameOfTheFile) {
  const Scratch scratch;
  const Recording recording = large_recording();
  std::filesystem::create_directory(scratch / "folder.db");
  EXPECT_TRUE(says(write_recording(recording, scratch / "folder.db"), "is a folder"));
  EXPECT_TRUE(says(write_recording(recording, "/proc/r.db"), "/proc/r.db"));
  EXPECT_TRUE(says(write_recording(recording, scratch / "no/such/r.db"), "choose a folder"));
  const auto writer = RecordingWriter::create("/proc/r.db", {}, recording.channels);
  ASSERT_FALSE(writer.ok());
  EXPECT_NE(writer.error().message.find("/proc/r.db"), std::string::npos);
}

TEST(Permission, NoRecordingReplacesWhatIsNoFile) {
  const Scratch scratch;
  const auto pipe = scratch / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Recording recording = large_recording();
  EXPECT_TRUE(says(write_recording(recording, pipe, true), "device"));
  EXPECT_FALSE(RecordingWriter::create(pipe, {}, recording.channels, true).ok());
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

}  // namespace
}  // namespace ravencal::record
