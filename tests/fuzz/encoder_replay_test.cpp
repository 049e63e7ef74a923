// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "encoder_input.hpp"

namespace ravencal::fuzz {
namespace {

TEST(EncoderCorpus, BreaksNoPromise) {
  int count = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(RAVENCAL_SOURCE_DIR "/tests/fuzz/encoder_corpus")) {
    SCOPED_TRACE(file.path().string());
    std::ifstream stream(file.path(), std::ios::binary);
    const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(stream)), {});
    try_encoder(bytes);
    ++count;
  }
  EXPECT_GE(count, 8);
}

}  // namespace
}  // namespace ravencal::fuzz
