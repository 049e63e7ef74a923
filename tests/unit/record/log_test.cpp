// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <sstream>

#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "unit/record/scratch.hpp"

namespace ravencal::record {
namespace {
using testing::Scratch;
namespace fs = std::filesystem;

constexpr int kLoggedRows = 2000;
constexpr std::size_t kLogHeader = 32;
constexpr std::size_t kFrame = 24 + 4096;

std::string bytes_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void set_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

/// A recording whose writer ended without finishing: rows 1 to kLoggedRows, a commit every ten.
void leave_log(const fs::path& path) {
  const pid_t child = ::fork();
  if (child == 0) {
    auto writer = RecordingWriter::create(
        path, {}, {{"a", "rad", Role::kFeature, ""}, {"b", "rad", Role::kFeature, ""}});
    const double row[] = {0.5, -0.5};
    for (int r = 1; r <= kLoggedRows; ++r) {
      if (!writer->append(r, row).ok() || (r % 10 == 0 && !writer->flush().ok())) ::_exit(1);
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
}

class DamagedLog : public ::testing::Test {
 protected:
  void SetUp() override {
    leave_log(path_);
    log_ = bytes_of(path_.string() + "-wal");
    ASSERT_GT(log_.size(), kLogHeader + 20 * kFrame);
  }
  [[nodiscard]] core::Result<Recording> read(bool skip_bad = false) const {
    fs::remove(path_.string() + "-shm");
    return read_recording(path_, {}, 0, skip_bad);
  }
  void damage(std::size_t at) const {
    std::string damaged = log_;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    set_bytes(path_.string() + "-wal", damaged);
  }

  Scratch scratch_;
  fs::path path_ = scratch_ / "r.db";
  std::string log_;
};

TEST_F(DamagedLog, IsNoneWhereTheWriterWasKilled) {
  ASSERT_TRUE(read().ok()) << read().error().message;
  EXPECT_EQ(read()->rows(), kLoggedRows);
  // Killed within a frame.
  for (const std::size_t cut : {1UL, 100UL, 4096UL, kFrame, 3 * kFrame + 7}) {
    set_bytes(path_.string() + "-wal", log_.substr(0, log_.size() - cut));
    const auto cut_short = read();
    ASSERT_TRUE(cut_short.ok()) << cut_short.error().message;
    EXPECT_GT(cut_short->rows(), kLoggedRows - 100);
  }
}

TEST_F(DamagedLog, IsToldWithTheRowsThatAreLost) {
  const std::size_t frames = (log_.size() - kLogHeader) / kFrame;
  std::mt19937 random(5);
  std::uniform_int_distribution<std::size_t> anywhere(0, kLogHeader + (frames - 3) * kFrame);
  for (int trial = 0; trial < 60; ++trial) {
    const std::size_t at = trial < 24 ? static_cast<std::size_t>(trial) : anywhere(random);
    if (at >= 4 && at < 8) continue;  // the format's version, which SQLite checks by itself
    damage(at);
    const auto refused = read();
    ASSERT_FALSE(refused.ok()) << "byte " << at;
    EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
    const auto rest = read(true);
    if (!rest.ok()) continue;  // damage within the first commits leaves no table
    EXPECT_LT(rest->rows(), kLoggedRows) << "byte " << at;
    EXPECT_EQ(rest->meta.at("dropped_rows"), std::to_string(kLoggedRows - rest->rows()))
        << "byte " << at;
    ASSERT_FALSE(rest->events.empty());
    EXPECT_EQ(rest->events.back().kind, "drop");
    EXPECT_NE(refused.error().message.find("--skip-bad"), std::string::npos);
    for (Eigen::Index r = 0; r < rest->rows(); ++r)
      EXPECT_EQ(rest->t_ns[static_cast<std::size_t>(r)], r + 1);
  }
}

// A log that begins anew keeps frames of the one before it behind its own.
TEST_F(DamagedLog, IsNoneInALogThatBeganAnew) {
  const Scratch scratch;
  const fs::path path = scratch / "r.db";
  auto writer = RecordingWriter::create(path, {}, {{"a", "rad", Role::kFeature, ""}});
  ASSERT_TRUE(writer.ok());
  const double value[] = {1.0};
  for (int r = 1; r <= 30'000; ++r) {
    ASSERT_TRUE(writer->append(r, value).ok());
    if (r % 20 != 0) continue;
    ASSERT_TRUE(writer->flush().ok());
    if (r % 400 != 0) continue;
    const auto now = read_recording(path);
    ASSERT_TRUE(now.ok()) << now.error().message;
    EXPECT_EQ(now->rows(), r);
  }
}

}  // namespace
}  // namespace ravencal::record
