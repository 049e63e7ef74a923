// SPDX-License-Identifier: Apache-2.0
#include "core/whole_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

namespace ravencal::core {
namespace {
namespace fs = std::filesystem;

class WholeFile : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  fs::path folder_ =
      fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::path file_ = folder_ / "file";
};

TEST_F(WholeFile, ReadsBackEveryByte) {
  std::string bytes(200'000, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 7);
  ASSERT_TRUE(write_whole_file(file_, bytes).ok());
  EXPECT_EQ(*read_whole_file(file_), bytes);
  ASSERT_TRUE(write_whole_file(file_, "").ok());
  EXPECT_EQ(*read_whole_file(file_), "");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WholeFile, LeavesTheOldFileAndNoPartialOneWhenItCannotBeReplaced) {
  fs::create_directories(file_ / "full");
  const Status status = write_whole_file(file_, "new");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_NE(status.error().message.find(file_.string()), std::string::npos);
  EXPECT_TRUE(fs::exists(file_ / "full"));
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WholeFile, LeavesTheOldFileAndNoPartialOneOnAFullDisk) {
  ASSERT_TRUE(write_whole_file(file_, "old").ok());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_IGN);  // then a write beyond the limit fails, as on a full disk
  const rlimit tight{4096, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  const Status status = write_whole_file(file_, std::string(100'000, 'x'));
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("File too large"), std::string::npos);
  EXPECT_EQ(*read_whole_file(file_), "old");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WholeFile, KeepsTheModeOfTheFileThatItReplaces) {
  for (const auto mode : {fs::perms(0600), fs::perms(0444), fs::perms(0664)}) {
    ASSERT_TRUE(write_whole_file(file_, "old").ok());
    fs::permissions(file_, mode);
    ASSERT_TRUE(write_whole_file(file_, "new").ok());
    EXPECT_EQ(fs::status(file_).permissions(), mode);
  }
}

TEST_F(WholeFile, ReplacesWhatALinkLeadsToAndLeavesTheLink) {
  fs::create_directories(folder_ / "elsewhere");
  ASSERT_TRUE(write_whole_file(folder_ / "elsewhere" / "file", "old").ok());
  fs::create_symlink("elsewhere/file", file_);
  ASSERT_TRUE(write_whole_file(file_, "new").ok());
  EXPECT_TRUE(fs::is_symlink(file_));
  EXPECT_EQ(*read_whole_file(folder_ / "elsewhere" / "file"), "new");
}

TEST_F(WholeFile, WritesToAPipeAndNeverReplacesIt) {
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);
  const int reader = ::open(file_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  ASSERT_TRUE(write_whole_file(file_, "said").ok());
  std::array<char, 16> heard{};
  EXPECT_EQ(::read(reader, heard.data(), heard.size()), 4);
  ::close(reader);
  EXPECT_STREQ(heard.data(), "said");
  EXPECT_TRUE(fs::is_fifo(file_));
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WholeFile, RemovesAPartialFileThatIsNotPublished) {
  {
    const auto target = PartialFile::create(file_);
    ASSERT_TRUE(target.ok());
    std::ofstream(target->partial()) << "half";
    EXPECT_EQ(entries(), 1U);
  }
  EXPECT_EQ(entries(), 0U);
}

TEST_F(WholeFile, GivesTwoWritersOfOneNameTwoPartialFiles) {
  auto first = PartialFile::create(file_);
  auto second = PartialFile::create(file_);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_NE(first->partial(), second->partial());
  std::ofstream(first->partial()) << "first";
  std::ofstream(second->partial()) << "second";
  EXPECT_TRUE(second->publish().ok());
  EXPECT_TRUE(first->publish().ok());
  EXPECT_EQ(*read_whole_file(file_), "first");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WholeFile, SaysWhyItCannotRead) {
  const auto absent = read_whole_file(folder_ / "absent");
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, ErrorCode::kIo);
  EXPECT_NE(absent.error().message.find("No such file"), std::string::npos);
  const auto folder = read_whole_file(folder_);
  ASSERT_FALSE(folder.ok());
  EXPECT_NE(folder.error().message.find("directory"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::core
