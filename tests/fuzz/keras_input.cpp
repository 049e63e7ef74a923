// SPDX-License-Identifier: Apache-2.0
#include "fuzz/network_promises.hpp"

namespace ravencal::fuzz {

void try_keras(Bytes bytes) {
  const auto path = scratch_file("fuzz.h5", bytes);
  const auto model = conversion::read_keras(path);
  if (read_or_words(model, path.string())) promise_chain(*model);
}

}  // namespace ravencal::fuzz
