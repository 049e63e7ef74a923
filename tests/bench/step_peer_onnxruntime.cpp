// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peers.hpp"

namespace ravencal::bench {

Peer onnxruntime_peer(const kernels_test::Network& /*network*/) {
  return {"onnxruntime", 0, {}, "not found when this was built (onnxruntime_c_api.h)"};
}

}  // namespace ravencal::bench
