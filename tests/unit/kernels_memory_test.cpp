// SPDX-License-Identifier: Apache-2.0
//
// Where the weights lie: what the kernel says of the blob's pages.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "rt_plugin/blob_memory.hpp"

namespace ravencal::rt {
namespace {

constexpr std::size_t kBlobBytes = 2'546'001;

/// Of the mapping that starts at `start`: kB behind `key` in /proc/self/smaps, -1 if absent.
long smaps_kb(const void* start, const std::string& key) {
  std::ifstream smaps("/proc/self/smaps");
  std::ostringstream wanted;
  wanted << std::hex << reinterpret_cast<std::uintptr_t>(start) << '-';
  bool inside = false;
  for (std::string line; std::getline(smaps, line);) {
    if (line.find('-') < line.find(' ')) inside = line.starts_with(wanted.str());
    if (inside && line.starts_with(key + ':')) return std::stol(line.substr(key.size() + 1));
  }
  return -1;
}

std::filesystem::path write_file(std::size_t bytes) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("ravencal_memory_" + std::to_string(::getpid()) + ".blob");
  std::ofstream(path, std::ios::binary) << std::string(bytes, 'r');
  return path;
}

bool huge_pages_on_request() {
  std::ifstream file("/sys/kernel/mm/transparent_hugepage/enabled");
  std::string modes;
  std::getline(file, modes);
  return modes.find("[madvise]") != std::string::npos ||
         modes.find("[always]") != std::string::npos;
}

class BlobPages : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  const std::filesystem::path path_ = write_file(kBlobBytes);
  std::array<char, 256> why_{};
  BlobMemory memory_;
};

TEST_F(BlobPages, AreAllTouchedBeforeTheFirstStep) {
  ASSERT_EQ(memory_.read(path_.c_str(), why_), BlobMemory::Status::kOk);
  EXPECT_EQ(memory_.bytes().back(), std::byte{'r'});
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory_.bytes().data()) % (2U << 20U), 0U);
  EXPECT_GE(smaps_kb(memory_.bytes().data(), "Rss"), static_cast<long>(kBlobBytes / 1024));
}

TEST_F(BlobPages, AreHugeWhereTheSystemGivesThem) {
  if (!huge_pages_on_request()) GTEST_SKIP() << "transparent huge pages are off in this system";
  ASSERT_EQ(memory_.read(path_.c_str(), why_), BlobMemory::Status::kOk);
  const long huge_kb = smaps_kb(memory_.bytes().data(), "AnonHugePages");
  if (huge_kb == 0) GTEST_SKIP() << "no free huge page at the moment";
  EXPECT_EQ(huge_kb, 4096);
}

TEST_F(BlobPages, AreGivenBackWhole) {
  ASSERT_EQ(memory_.read(path_.c_str(), why_), BlobMemory::Status::kOk);
  const std::span<std::byte> bytes = memory_.release();
  BlobMemory::free(bytes);
  EXPECT_EQ(smaps_kb(bytes.data(), "Rss"), -1);
  unsigned char resident = 0;
  constexpr std::size_t kLastPage = (4U << 20U) - 4096;
  EXPECT_EQ(::mincore(bytes.data() + kLastPage, 4096, &resident), -1);  // not mapped
}

}  // namespace
}  // namespace ravencal::rt
