// SPDX-License-Identifier: Apache-2.0
#include "fuzz/network_promises.hpp"

namespace ravencal::fuzz {

void try_onnx(Bytes bytes) {
  const auto path = scratch_file("fuzz.onnx", bytes);
  const auto model = conversion::read_foreign_onnx(path);
  if (read_or_words(model, path.string())) promise_chain(*model);
}

}  // namespace ravencal::fuzz
