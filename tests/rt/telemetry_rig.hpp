// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <string>
#include <utility>

#include "rt/rig.hpp"

namespace ravencal::test {

/// A rig whose plugin writes telemetry; `name` empty: one without.
inline core::Status give_telemetry(Rig& rig, const std::string& name) {
  std::strncpy(rig.config.telemetry_name, name.c_str(), sizeof rig.config.telemetry_name - 1);
  auto instance = host::PluginInstance::create(rig.library, rig.config);
  if (!instance.ok()) return instance.error();
  rig.instance = std::move(instance).value();
  return {};
}

/// Finite weights whose products cancel on the self-test's rows and overflow where overflow() goes.
inline model::CalibrationModel overflowing_model() {
  model::CalibrationModel model = make_model({plain("jpos.shoulder"), plain("jpos.elbow")}, {2, 2});
  for (model::DenseLayer& layer : model.layers) layer.activation = model::Activation::kLinear;
  model.layers[0].weights << 1.8e38F, -1.8e38F, 0.0F, 0.0F;
  model.layers[0].biases.setZero();
  model.layers[1].weights << 2e-38F, 0.0F, 0.0F, 0.0F;
  model.layers[1].biases.setZero();
  return model;
}
inline void overflow(ravencal_state& state) {
  const ravencal_state healthy = healthy_state();
  state.arm[0].jpos_ji[0] = healthy.arm[0].jpos_ji[0] + 0.5F;
  state.arm[0].jpos_ji[1] = healthy.arm[0].jpos_ji[1] - 0.5F;
}

}  // namespace ravencal::test
