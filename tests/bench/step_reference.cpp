// SPDX-License-Identifier: Apache-2.0
#include "bench/step_reference.hpp"

#include <cmath>

#include "model/kernel_promise.hpp"
#include "model/packed_model.hpp"

namespace ravencal::bench {

Reference stored_reference(const model::CalibrationModel& stored,
                           const Eigen::VectorXf& features_si) {
  const model::KernelPromise promise = model::kernel_promise(stored, features_si);
  Reference reference;
  for (Eigen::Index j = 0; j < promise.outputs.rows(); ++j) {
    const double scale = stored.output.scale[j];
    reference.outputs.push_back((promise.outputs(j, 0) - stored.output.mean[j]) / scale);
    reference.bound.push_back(promise.error(j, 0) / scale);
  }
  return reference;
}

Reference stored_reference(std::span<const std::byte> packed_network,
                           const std::vector<float>& inputs) {
  model::CalibrationModel model;
  model.layers = model::unpack_layers(packed_network).value();
  const auto unscaled = [](Eigen::Index size) -> model::Standardiser {
    return {Eigen::VectorXd::Zero(size), Eigen::VectorXd::Ones(size)};
  };
  const Eigen::Map<const Eigen::VectorXf> features(inputs.data(),
                                                   static_cast<Eigen::Index>(inputs.size()));
  model.input = unscaled(features.size());
  model.output = unscaled(model.layers.back().weights.rows());
  return stored_reference(model, features);
}

Deviation deviation(const Reference& reference, std::span<const float> outputs) {
  Deviation worst;
  double worst_share = -1.0;
  for (std::size_t j = 0; j < reference.outputs.size(); ++j) {
    Deviation here{std::abs(static_cast<double>(outputs[j]) - reference.outputs[j]), {}};
    if (!reference.bound.empty()) here.bound = reference.bound[j];
    const double share = here.bound ? here.error / *here.bound : here.error;
    if (share <= worst_share) continue;  // no number is worse than any
    worst = here;
    worst_share = share;
    if (std::isnan(share)) break;
  }
  return worst;
}

}  // namespace ravencal::bench
