// SPDX-License-Identifier: Apache-2.0
#include "conversion/chain_builder.hpp"

#include <fmt/format.h>

namespace ravencal::conversion {
namespace {

/// Three blocks of `units` rows, each padded to whole lines of the kernels with zeros.
template <typename Rows>
Rows padded_gates(const Rows& rows, Eigen::Index units) {
  using model::packed::kLineLanes;
  using model::packed::padded;
  const auto block = static_cast<Eigen::Index>(padded(static_cast<std::size_t>(units), kLineLanes));
  Rows result = Rows::Zero(3 * block, rows.cols());
  for (Eigen::Index gate = 0; gate < 3; ++gate) {
    result.middleRows(gate * block, units) = rows.middleRows(gate * units, units);
  }
  return result;
}

}  // namespace

ChainBuilder::ChainBuilder(Eigen::Index inputs) : width_(inputs) { network_.inputs = inputs; }

void ChainBuilder::scale(const Eigen::VectorXd& gain, const Eigen::VectorXd& offset) {
  if (pending_.gain.size() == 0) {
    const bool is_addition = (gain.array() == 1.0).all();
    if (is_addition && !layers_.empty() && layers_.back().is_open && !layers_.back().has_biases) {
      layers_.back().biases += offset;
      layers_.back().has_biases = true;
      return;
    }
    pending_ = {gain, offset};
    return;
  }
  pending_ = {gain.cwiseProduct(pending_.gain), gain.cwiseProduct(pending_.offset) + offset};
}

core::Status ChainBuilder::batch_normalise(const Eigen::VectorXd& scale,
                                           const Eigen::VectorXd& offset,
                                           const Eigen::VectorXd& mean,
                                           const Eigen::VectorXd& variance, double epsilon) {
  const Eigen::VectorXd square = variance.array() + epsilon;
  if (!(square.array() > 0.0).all()) {
    return core::data_error(
        fmt::format("a variance of {:g} with epsilon {:g} has no root to divide by",
                    variance.minCoeff(), epsilon));
  }
  const Eigen::VectorXd gain = scale.cwiseQuotient(square.cwiseSqrt());
  normalise(gain, offset - gain.cwiseProduct(mean));
  return {};
}

void ChainBuilder::normalise(const Eigen::VectorXd& gain, const Eigen::VectorXd& offset) {
  const bool is_learned = pending_.gain.size() == 0 || pending_.is_learned;
  Layer* before = opened();
  scale(gain, offset);
  if (before != nullptr) {
    (void)opened();
  } else {
    pending_.is_learned = is_learned;
  }
}

ChainBuilder::Layer* ChainBuilder::opened() {
  if (layers_.empty() || !layers_.back().is_open) return nullptr;
  Layer& layer = layers_.back();
  if (pending_.gain.size() > 0) {
    layer.weights = pending_.gain.asDiagonal() * layer.weights;
    layer.biases = pending_.gain.cwiseProduct(layer.biases) + pending_.offset;
    layer.has_biases = true;
    pending_ = {};
  }
  return &layer;
}

void ChainBuilder::fold_into_inputs_of(Eigen::MatrixXd& weights, Eigen::VectorXd& biases) {
  if (pending_.gain.size() == 0) return;
  if (layers_.empty()) {
    network_.input = pending_;
  } else {
    biases += weights * pending_.offset;
    weights = weights * pending_.gain.asDiagonal();
  }
  pending_ = {};
}

void ChainBuilder::dense(const Eigen::MatrixXd& weights, const Eigen::VectorXd* biases) {
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(weights.rows());
  Layer layer{weights, biases != nullptr ? *biases : zeros, {}, true, biases != nullptr};
  fold_into_inputs_of(layer.weights, layer.biases);
  if (!layers_.empty() && layers_.back().is_sum_of_leaks) {
    layer.biases += layer.weights * layers_.back().biases;
    layer.weights = layer.weights * layers_.back().weights;
    layer.has_biases = true;
    layers_.pop_back();
  }
  layers_.push_back(std::move(layer));
  width_ = weights.rows();
}

void ChainBuilder::gru(const Eigen::MatrixXd& input_weights, const Eigen::VectorXd& input_biases,
                       const Eigen::MatrixXd& recurrent_weights,
                       const Eigen::VectorXd& recurrent_biases) {
  const Eigen::Index units = recurrent_weights.cols();
  Layer projection{
      padded_gates(input_weights, units), padded_gates(input_biases, units), {}, false, true};
  Layer recurrence{padded_gates(recurrent_weights, units),
                   padded_gates(recurrent_biases, units),
                   {},
                   false,
                   true};
  projection.kind.kind = model::packed::LayerKind::kGruInput;
  recurrence.kind.kind = model::packed::LayerKind::kGruRecurrent;
  fold_into_inputs_of(projection.weights, projection.biases);
  layers_.push_back(std::move(projection));
  layers_.push_back(std::move(recurrence));
  network_.has_gru = true;
  width_ = units;
}

core::Status ChainBuilder::activate(model::Activation activation) {
  if (activation == model::Activation::kLinear) return {};
  Layer* layer = opened();
  if (layer == nullptr) {
    return core::data_error(
        "an activation without a dense layer right before it; the weights hold none there. Train "
        "with one before it, or without the activation");
  }
  layer->kind.activation = activation;
  layer->is_open = false;
  layer->is_sum_of_leaks = false;
  return {};
}

core::Status ChainBuilder::leak(const Eigen::VectorXd& slopes) {
  RAVENCAL_RETURN_IF_ERROR(activate(model::Activation::kRelu));
  if ((slopes.array() == 0.0).all()) return {};
  Layer& layer = layers_.back();
  const auto both_signs = [](const auto& rows) {
    auto result = rows;
    result.resize(2 * rows.rows(), rows.cols());
    result << rows, -rows;
    return result;
  };
  layer.weights = both_signs(layer.weights);
  layer.biases = both_signs(layer.biases);
  const Eigen::Index units = slopes.size();
  Layer sum{Eigen::MatrixXd(units, 2 * units), Eigen::VectorXd::Zero(units), {}};
  sum.weights << Eigen::MatrixXd::Identity(units, units), Eigen::MatrixXd((-slopes).asDiagonal());
  sum.is_sum_of_leaks = true;
  layers_.push_back(std::move(sum));
  return {};
}

core::Result<ForeignNetwork> ChainBuilder::finish() && {
  if (layers_.empty()) return core::data_error("there is no layer in it");
  if (pending_.is_learned) dense(Eigen::MatrixXd::Identity(width_, width_), nullptr);
  if (layers_.back().kind.kind != model::packed::LayerKind::kDense) {
    return core::data_error("nothing follows the GRU; the outputs need a dense layer behind it");
  }
  network_.output = pending_;
  network_.outputs = width_;
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    model::DenseLayer layer = layers_[l].kind;
    layer.weights = layers_[l].weights.cast<float>();
    layer.biases = layers_[l].biases.cast<float>();
    if (!layer.weights.allFinite() || !layer.biases.allFinite()) {
      return core::data_error(
          fmt::format("layer {} has a weight that is not finite in single precision", l + 1));
    }
    network_.layers.push_back(std::move(layer));
  }
  return std::move(network_);
}

}  // namespace ravencal::conversion
