// SPDX-License-Identifier: Apache-2.0
//
// How a file takes its name: what others do in the same folder meanwhile, several files at once.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/output_place.hpp"
#include "core/whole_file.hpp"

namespace ravencal::core {
namespace {
namespace fs = std::filesystem;

class OutputFile : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  static std::string text_in(const fs::path& path) {
    const auto text = read_whole_file(path);
    return text.ok() ? *text : text.error().message;
  }
  [[nodiscard]] std::size_t count_of_entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("outputs_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::path file_ = folder_ / "file";
};

TEST_F(OutputFile, BecomesWholeWhereNobodyElseMayEnter) {
  const auto file = PartialFile::create(file_);
  ASSERT_TRUE(file.ok());
  const fs::path place = file->partial().parent_path();
  EXPECT_EQ(place.parent_path(), folder_);
  EXPECT_EQ(fs::status(place).permissions(), fs::perms(0700));
}

TEST_F(OutputFile, IsWrittenAlthoughItsFolderIsExchangedForOneWithALink) {
  const fs::path victim = folder_ / "victim";
  ASSERT_TRUE(write_whole_file(victim, "precious").ok());
  auto file = PartialFile::create(file_);
  ASSERT_TRUE(file.ok());
  const fs::path place = file->partial().parent_path();
  fs::rename(place, folder_ / "taken");
  fs::create_directory(place);
  fs::create_symlink(victim, file->partial());
  ASSERT_EQ(::write(file->descriptor(), "own", 3), 3);
  EXPECT_TRUE(file->publish().ok());
  EXPECT_EQ(text_in(victim), "precious");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file_)));
  EXPECT_EQ(text_in(file_), "own");
}

TEST_F(OutputFile, IsNotPublishedWhereItWasExchangedItself) {
  auto file = PartialFile::create(file_);
  ASSERT_TRUE(file.ok());
  fs::remove(file->partial());
  fs::create_symlink("/etc/passwd", file->partial());
  EXPECT_FALSE(file->publish().ok());
  EXPECT_FALSE(fs::exists(fs::symlink_status(file_)));
}

TEST_F(OutputFile, TakesANewNameOnlyOnce) {
  auto first = PartialFile::create(file_);
  auto second = PartialFile::create(file_);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_TRUE(first->publish_new().ok());
  const Status refused = second->publish_new();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
}

TEST_F(OutputFile, IsNoLinkToNothing) {
  fs::create_symlink("nowhere", file_);
  const Status status = write_whole_file(file_, "text");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(fs::is_symlink(file_));
  EXPECT_EQ(count_of_entries(), 1U);
}

TEST_F(OutputFile, IsNoLibrary) {
  std::ofstream(file_) << "\x7f"
                          "ELF and more";
  const Status status = write_whole_file(file_, "text");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kUsage);
}

TEST_F(OutputFile, GoesThroughADescriptorWhoseFileIsDeleted) {
  const int gone = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_GE(gone, 0);
  fs::remove(file_);
  const fs::path by_number = fs::path("/proc/self/fd") / std::to_string(gone);
  fs::create_symlink(by_number, folder_ / "link");
  EXPECT_EQ(output_place(folder_ / "link").descriptor, gone);
  EXPECT_EQ(output_place("/dev/fd/" + std::to_string(gone)).descriptor, gone);
  EXPECT_TRUE(write_whole_file(by_number, "one ").ok());
  EXPECT_TRUE(write_whole_file(folder_ / "link", "two").ok());
  std::array<char, 16> text{};
  EXPECT_EQ(::pread(gone, text.data(), text.size(), 0), 7);
  EXPECT_STREQ(text.data(), "one two");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(count_of_entries(), 1U);
  ::close(gone);
}

TEST_F(OutputFile, OfAGroupAppearsWithTheOthers) {
  ASSERT_TRUE(write_whole_file(file_, "old").ok());
  {
    OutputGroup group;
    EXPECT_TRUE(write_whole_file(file_, "first").ok());
    EXPECT_TRUE(write_whole_file(file_, "new").ok());
    EXPECT_TRUE(write_whole_file(folder_ / "other", "other").ok());
    EXPECT_EQ(text_in(file_), "old");
    EXPECT_TRUE(group.publish().ok());
  }
  EXPECT_EQ(text_in(file_), "new");
  EXPECT_EQ(text_in(folder_ / "other"), "other");
  EXPECT_EQ(count_of_entries(), 2U);
}

TEST_F(OutputFile, OfAGroupStaysAsItWasWhereAnotherCannotAppear) {
  ASSERT_TRUE(write_whole_file(file_, "old").ok());
  fs::create_directory(folder_ / "sub");
  {
    OutputGroup group;
    EXPECT_TRUE(write_whole_file(file_, "new").ok());
    EXPECT_TRUE(write_whole_file(folder_ / "added", "new").ok());
    EXPECT_TRUE(write_whole_file(folder_ / "sub" / "lost", "new").ok());
    fs::remove_all(folder_ / "sub");
    EXPECT_FALSE(group.publish().ok());
  }
  EXPECT_EQ(text_in(file_), "old");
  EXPECT_EQ(count_of_entries(), 1U);
}

}  // namespace
}  // namespace ravencal::core
