// SPDX-License-Identifier: Apache-2.0
#include "core/whole_file.hpp"

#include <gtest/gtest.h>

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

TEST_F(WholeFile, RemovesAPartialFileThatIsNotPublished) {
  {
    const PartialFile target(file_);
    std::ofstream(target.partial()) << "half";
    EXPECT_EQ(entries(), 1U);
  }
  EXPECT_EQ(entries(), 0U);
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
