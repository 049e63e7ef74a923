// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <vector>

#include "../unit/record/scratch.hpp"
#include "csv_input.hpp"

namespace ravencal::fuzz {
namespace {

TEST(CsvCorpus, BreaksNoPromise) {
  const record::testing::Scratch scratch;
  int count = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(RAVENCAL_SOURCE_DIR "/tests/fuzz/csv_corpus")) {
    SCOPED_TRACE(file.path().string());
    std::ifstream stream(file.path(), std::ios::binary);
    const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(stream)), {});
    try_csv(bytes, scratch / "");
    ++count;
  }
  EXPECT_GE(count, 10);
}

}  // namespace
}  // namespace ravencal::fuzz
