// SPDX-License-Identifier: Apache-2.0
//
// Puts a network together in the order of its steps, and folds each scaling into the layer beside
// it, in double; only scaling before the first and behind the last layer is kept as such.
#pragma once

#include <cstdint>
#include <string>

#include "conversion/foreign_model.hpp"

namespace ravencal::conversion {

class ChainBuilder {
 public:
  explicit ChainBuilder(Eigen::Index inputs);

  /// Values that the next step receives.
  [[nodiscard]] Eigen::Index width() const { return width_; }

  [[nodiscard]] bool is_empty() const { return layers_.empty(); }

  /// Takes y = gain * x + offset; both [width()].
  void scale(const Eigen::VectorXd& gain, const Eigen::VectorXd& offset);
  /// Takes y = scale * (x - mean) / sqrt(variance + epsilon) + offset, all [width()], as a part of
  /// the network: never the scaling of its outputs. Errors (kData): no such root.
  core::Status batch_normalise(const Eigen::VectorXd& scale, const Eigen::VectorXd& offset,
                               const Eigen::VectorXd& mean, const Eigen::VectorXd& variance,
                               double epsilon);
  /// y = weights * x + biases; weights [outputs x width()], biases [outputs]. Without biases an
  /// addition that follows at once is theirs, not a scaling of the outputs.
  void dense(const Eigen::MatrixXd& weights, const Eigen::VectorXd* biases);
  /// A GRU in Keras' order of gates (update, reset, candidate), reset behind the recurrent product:
  /// input_weights [3 units x width()], recurrent_weights [3 units x units], biases [3 units].
  void gru(const Eigen::MatrixXd& input_weights, const Eigen::VectorXd& input_biases,
           const Eigen::MatrixXd& recurrent_weights, const Eigen::VectorXd& recurrent_biases);
  /// Errors (kData): no layer stands before it that could take it.
  core::Status activate(model::Activation activation);
  /// Takes y = x where x > 0, else slope * x; slopes [width()]. The weights hold it as
  /// relu(x) - slope * relu(-x), in twice the units. Errors as of activate().
  core::Status leak(const Eigen::VectorXd& slopes);

  /// Errors (kData): no layer; a weight that is not finite in single precision.
  core::Result<ForeignNetwork> finish() &&;

 private:
  struct Layer {
    Eigen::MatrixXd weights;
    Eigen::VectorXd biases;
    model::DenseLayer kind;  ///< without its numbers
    bool is_open = true;     ///< an activation may still follow
    bool has_biases = true;
    bool is_sum_of_leaks = false;  ///< the next dense layer takes it up
  };

  /// The layer that an activation may follow, with what is pending folded in; null if there is
  /// none.
  Layer* opened();
  void normalise(const Eigen::VectorXd& gain, const Eigen::VectorXd& offset);
  void fold_into_inputs_of(Eigen::MatrixXd& weights, Eigen::VectorXd& biases);

  ForeignNetwork network_;
  std::vector<Layer> layers_;
  Affine pending_;
  Eigen::Index width_;
};

}  // namespace ravencal::conversion
