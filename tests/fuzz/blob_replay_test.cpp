// SPDX-License-Identifier: Apache-2.0
//
// Every kept input of the blob fuzzer, and 200 000 mutations of the golden blob with a fixed seed,
// so that the harness runs in every build, not only where libFuzzer is.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "unit/blob_sample.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

void run(const std::string& bytes) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

TEST(BlobReplay, SurvivesEveryKeptInput) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tests" / "fuzz" / "blob_corpus")) {
    std::ifstream file(entry.path(), std::ios::binary);
    run({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()});
    ++files;
  }
  EXPECT_GT(files, 0);
}

TEST(BlobReplay, SurvivesRandomMutations) {
  std::mt19937_64 random(20230204);
  const std::vector<std::byte> golden = ravencal::test::golden_bytes();
  const std::string good(reinterpret_cast<const char*>(golden.data()), golden.size());
  for (int i = 0; i < 200'000; ++i) {
    std::string bytes = good;
    for (auto changes = 1 + random() % 4; changes > 0; --changes) {
      // Most changes go where the structure is: header, tables and names.
      const std::size_t limit = random() % 2 == 0 ? 512 : bytes.size();
      bytes[random() % limit] = static_cast<char>(random());
    }
    if (random() % 8 == 0) bytes.resize(random() % (2 * bytes.size()));
    run(bytes);
  }
}

}  // namespace
