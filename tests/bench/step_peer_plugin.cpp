// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peers.hpp"
#include "rt/rig.hpp"

namespace ravencal::bench {

Peer plugin_peer(const kernels_test::Network& network, kernels::Precision precision) {
  std::vector<std::uint32_t> hidden;
  for (const auto& layer : network) hidden.push_back(layer.outputs);
  hidden.pop_back();
  const auto rig = std::make_shared<test::Rig>();
  rig->load(test::make_model(network.front().inputs, hidden), precision);
  rig->enable();
  rig->tick_until(RAVENCAL_STATE_ACTIVE);
  auto step = [rig](const float*, float* y) {
    rig->tick();
    y[0] = rig->output.predicted_ji[0];
  };
  return {"ravencal plugin " + host::precision_name(rig->instance.info().precision),
          kernels_test::Packed(network, precision).bytes(),
          step,
          {},
          false};
}

}  // namespace ravencal::bench
