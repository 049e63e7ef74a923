// SPDX-License-Identifier: Apache-2.0
//
// Mini-batch training of a fully connected network with the paper's loss (arXiv 2302.04999 and its
// notebooks; Keras semantics): mean squared error, L1 + L2 on hidden kernels, L2 on hidden biases,
// L2 on hidden activations divided by the batch size, Adam, a fresh shuffle each epoch.
// A batch is cut into tiles of fixed size whose gradients are summed in a fixed order, so the
// weights do not depend on the number of threads. float trains; double checks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "learn/isa.hpp"
#include "learn/shape.hpp"

namespace ravencal::learn {

/// Defaults: the paper's.
struct AdamSettings {
  double learning_rate = 5e-4;
  double beta1 = 0.9;
  double beta2 = 0.999;
  double epsilon = 1e-7;
};

/// Penalties of hidden layers; the output layer has none. Defaults: the paper's.
struct Penalties {
  double l1_weights = 1e-5;
  double l2_weights = 1e-4;
  double l2_biases = 1e-4;
  double l2_activity = 1e-5;
};

struct TrainerSettings {
  AdamSettings adam;
  Penalties penalties;
  std::uint32_t epochs = 600;
  std::uint32_t batch = 1024;
  std::uint32_t tile = 256;  ///< samples per tile; part of the result's definition
  std::uint64_t seed = 3;
  unsigned threads = 0;  ///< 0: default_threads()
  /// Standard deviation of noise that each step of training adds to each scaled input; empty: none.
  /// Noise of variance s^2 on an input adds s^2 (d output / d input)^2 to the loss, to second order
  /// (Bishop, Neural Computation 7, 1995): a penalty on the slope, not on the input's use.
  std::vector<float> input_noise = {};
  Isa isa = best_isa();
};

/// Scaled samples, one per column: inputs [inputs x samples], targets [outputs x samples].
template <typename Scalar>
struct Samples {
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> inputs;
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> targets;
  [[nodiscard]] std::ptrdiff_t count() const { return inputs.cols(); }
};

struct Loss {
  double mean_squared_error = 0.0;
  double penalty = 0.0;
};

/// Losses of one epoch. `training` is the mean over the epoch's batches, each before its step.
struct EpochReport {
  std::uint32_t epoch = 0;  ///< from 1
  double training = 0.0;
  double penalty = 0.0;     ///< of weights and biases, after the epoch
  double validation = 0.0;  ///< NaN without validation samples
  bool best = false;        ///< lowest validation loss so far; always true without validation
};

/// Cores, but no more than there are tiles in a batch; 1 for a step below about 0.1 ms of work.
unsigned default_threads(const Shape& shape, const TrainerSettings& settings);

template <typename Scalar>
class Trainer {
 public:
  /// Starts from `parameters`, shape [shape.parameter_count()].
  Trainer(Shape shape, const TrainerSettings& settings, std::span<const double> parameters);
  ~Trainer();
  Trainer(const Trainer&) = delete;
  Trainer& operator=(const Trainer&) = delete;

  /// Loss and gradient of all samples as one batch. gradient: shape [parameter_count].
  Loss loss_and_gradient(const Samples<Scalar>& samples, std::span<Scalar> gradient);

  /// One pass over the samples in random order; returns the mean squared error of its batches.
  double run_epoch(const Samples<Scalar>& samples);

  /// Mean squared error without training.
  double mean_squared_error(const Samples<Scalar>& samples);

  /// L1 and L2 of weights and biases.
  [[nodiscard]] double weight_penalty() const;

  [[nodiscard]] std::span<const Scalar> parameters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class Trainer<float>;
extern template class Trainer<double>;

struct FitResult {
  std::vector<float> parameters;  ///< of the kept epoch
  std::vector<EpochReport> epochs;
  std::uint32_t kept_epoch = 0;  ///< 0: interrupted before the first epoch was over
  bool interrupted = false;
};

/// Trains for settings.epochs, or until `keep_going` returns false (called after each epoch).
/// With validation samples the best epoch's weights are kept, otherwise the last epoch's.
FitResult fit(const Shape& shape, const TrainerSettings& settings, const Samples<float>& training,
              const Samples<float>* validation,
              const std::function<bool(const EpochReport&)>& keep_going);

}  // namespace ravencal::learn
