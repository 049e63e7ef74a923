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

  /// Takes y = gain * x + offset; both [width()].
  void scale(const Eigen::VectorXd& gain, const Eigen::VectorXd& offset);
  /// y = weights * x + biases; weights [outputs x width()], biases [outputs]. Without biases an
  /// addition that follows at once is theirs, not a scaling of the outputs.
  void dense(const Eigen::MatrixXd& weights, const Eigen::VectorXd* biases);
  /// A GRU in Keras' order of gates (update, reset, candidate), reset behind the recurrent product:
  /// input_weights [3 units x width()], recurrent_weights [3 units x units], biases [3 units].
  void gru(const Eigen::MatrixXd& input_weights, const Eigen::VectorXd& input_biases,
           const Eigen::MatrixXd& recurrent_weights, const Eigen::VectorXd& recurrent_biases);
  /// Errors (kData): no layer stands before it that could take it.
  core::Status activate(model::Activation activation);

  /// Errors (kData): no layer; a weight that is not finite in single precision.
  core::Result<ForeignNetwork> finish() &&;

 private:
  struct Layer {
    Eigen::MatrixXd weights;
    Eigen::VectorXd biases;
    model::DenseLayer kind;  ///< without its numbers
    bool is_open = true;     ///< an activation may still follow
    bool has_biases = true;
  };

  void fold_into_inputs_of(Eigen::MatrixXd& weights, Eigen::VectorXd& biases);

  ForeignNetwork network_;
  std::vector<Layer> layers_;
  Affine pending_;
  Eigen::Index width_;
};

}  // namespace ravencal::conversion
