// SPDX-License-Identifier: Apache-2.0
//
// libFuzzer harness. Run: encoder_fuzz -max_len=4096 NEW_CORPUS tests/fuzz/encoder_corpus
// A crash becomes a file in tests/fuzz/encoder_corpus, which encoder_replay_test reads for ever.
#include "encoder_input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ravencal::fuzz::try_encoder({data, size});
  return 0;
}
