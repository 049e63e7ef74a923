// SPDX-License-Identifier: Apache-2.0
//
// Every kept input of the blob fuzzer, and mutations of every golden blob with a fixed seed, so
// that the harness runs in every build, not only where libFuzzer is.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
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

/// How many mutations of each golden blob: RAVENCAL_FUZZ_INPUTS, or what a test run has time for.
std::uint64_t mutations() {
  const char* const asked = std::getenv("RAVENCAL_FUZZ_INPUTS");
  return asked != nullptr ? std::strtoull(asked, nullptr, 10) : 100'000;
}

class BlobMutations : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Golden, BlobMutations,
                         ::testing::Values("weights_v2.blob", "weights_v2_bf16.blob",
                                           "weights_v2_int8.blob", "weights_v2_1.blob",
                                           "weights_v2_2.blob"));

TEST_P(BlobMutations, AreReadOrRefusedWithoutACrash) {
  std::mt19937_64 random(20230204);
  const std::vector<std::byte> golden = ravencal::test::golden_bytes(GetParam());
  const std::string good(reinterpret_cast<const char*>(golden.data()), golden.size());
  ASSERT_FALSE(good.empty());
  std::string bytes;
  for (std::uint64_t i = mutations(); i > 0; --i) {
    bytes = good;
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
