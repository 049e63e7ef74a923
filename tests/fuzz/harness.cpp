// SPDX-License-Identifier: Apache-2.0
//
// Entry of libFuzzer and AFL++ (which runs the same entry in persistent mode) for one parser, which
// the build names. Run: tests/fuzz/run PARSER MINUTES
#include "fuzz/inputs.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ravencal::fuzz::RAVENCAL_FUZZ_TRY({data, size});
  return 0;
}
