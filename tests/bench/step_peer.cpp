// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peer.hpp"

#include <Eigen/Core>

namespace ravencal::bench {

struct DynamicNetwork::Impl {
  struct Layer {
    Eigen::MatrixXf weights;
    Eigen::VectorXf biases;
    Eigen::VectorXf sums;
  };
  std::vector<Layer> layers;
};

DynamicNetwork::DynamicNetwork(const std::vector<std::size_t>& sizes) : impl_(new Impl) {
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l) {
    const auto rows = static_cast<Eigen::Index>(sizes[l + 1]);
    const auto columns = static_cast<Eigen::Index>(sizes[l]);
    impl_->layers.push_back({0.05F * Eigen::MatrixXf::Random(rows, columns),
                             Eigen::VectorXf::Random(rows), Eigen::VectorXf(rows)});
  }
}

DynamicNetwork::~DynamicNetwork() { delete impl_; }

void DynamicNetwork::run(std::span<const float> inputs, std::span<float> outputs) {
  const Eigen::Map<const Eigen::VectorXf> first(inputs.data(),
                                                static_cast<Eigen::Index>(inputs.size()));
  for (std::size_t l = 0; l < impl_->layers.size(); ++l) {
    Impl::Layer& layer = impl_->layers[l];
    if (l == 0) {
      layer.sums.noalias() = layer.weights * first;
    } else {
      layer.sums.noalias() = layer.weights * impl_->layers[l - 1].sums;
    }
    layer.sums += layer.biases;
    if (l + 1 < impl_->layers.size()) layer.sums = layer.sums.array().logistic();
  }
  const Eigen::VectorXf& last = impl_->layers.back().sums;
  for (std::size_t j = 0; j < outputs.size(); ++j) outputs[j] = last[static_cast<Eigen::Index>(j)];
}

}  // namespace ravencal::bench
