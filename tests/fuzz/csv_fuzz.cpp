// SPDX-License-Identifier: Apache-2.0
//
// libFuzzer harness. Run: csv_fuzz -max_len=4096 NEW_CORPUS tests/fuzz/csv_corpus
// A crash becomes a file in tests/fuzz/csv_corpus, which csv_replay_test reads for ever.
#include <unistd.h>

#include <string>

#include "csv_input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "ravencal_fuzz_XXXXXX").string();
    return std::filesystem::path(::mkdtemp(name.data()));
  }();
  ravencal::fuzz::try_csv({data, size}, folder);
  return 0;
}
