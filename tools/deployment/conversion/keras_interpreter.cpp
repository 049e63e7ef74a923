// SPDX-License-Identifier: Apache-2.0
//
// Runs a Keras model layer by layer in double, in Keras' own shapes and order of gates (z, r, h):
// the reference for a folded chain, so it shares no arithmetic with the folding.
#include <fmt/format.h>

#include <cmath>

#include "conversion/keras_file.hpp"

namespace ravencal::conversion {
namespace {

using Values = std::vector<double>;

double sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }

double activated(const std::string& activation, double x) {
  if (activation == "sigmoid") return sigmoid(x);
  if (activation == "tanh") return std::tanh(x);
  if (activation == "relu") return std::fmax(x, 0.0);
  if (activation == "leaky_relu") return x < 0.0 ? kKerasLeakyActivationSlope * x : x;
  return x;
}

/// x @ kernel + row `bias_row` of the bias, if there is one.
Values product(const KerasLayer& layer, const char* kernel_name, const Values& x,
               Eigen::Index bias_row) {
  const Eigen::MatrixXd& kernel = layer.weights.at(kernel_name);
  Values y(static_cast<std::size_t>(kernel.cols()), 0.0);
  for (Eigen::Index o = 0; o < kernel.cols(); ++o) {
    double sum = layer.use_bias ? layer.weights.at("bias")(bias_row, o) : 0.0;
    for (Eigen::Index i = 0; i < kernel.rows(); ++i)
      sum += x[static_cast<std::size_t>(i)] * kernel(i, o);
    y[static_cast<std::size_t>(o)] = sum;
  }
  return y;
}

Values run_gru(const KerasLayer& layer, const std::vector<Values>& window) {
  const auto units = static_cast<std::size_t>(layer.units);
  Values h(units, 0.0);
  for (const Values& sample : window) {
    const Values x = product(layer, "kernel", sample, 0);
    const Values inner = product(layer, "recurrent_kernel", h, 1);
    for (std::size_t u = 0; u < units; ++u) {
      const double z = sigmoid(x[u] + inner[u]);
      const double r = sigmoid(x[units + u] + inner[units + u]);
      const double candidate = std::tanh(x[2 * units + u] + r * inner[2 * units + u]);
      h[u] = z * h[u] + (1.0 - z) * candidate;
    }
  }
  return h;
}

/// Element `i` of weights, else of the configuration, else `otherwise`; a single one is for all.
double element(const KerasLayer& layer, const char* role, std::size_t i, double otherwise) {
  const auto weights = layer.weights.find(role);
  if (weights != layer.weights.end()) {
    return weights->second(0, weights->second.cols() == 1 ? 0 : static_cast<Eigen::Index>(i));
  }
  const auto numbers = layer.numbers.find(role);
  if (numbers == layer.numbers.end()) return otherwise;
  return numbers->second.size() == 1 ? numbers->second.front() : numbers->second[i];
}

/// What a layer that joins no values makes of the one at `i`.
double one_by_one(const KerasLayer& layer, std::size_t i, double x) {
  const std::string& name = layer.class_name;
  if (name == "BatchNormalization") {
    const double gamma = layer.weights.contains("gamma") ? element(layer, "gamma", i, 1.0) : 1.0;
    const double root = std::sqrt(element(layer, "moving_variance", i, 1.0) +
                                  layer.number_or("epsilon", kKerasBatchEpsilon));
    return (x - element(layer, "moving_mean", i, 0.0)) / root * gamma +
           element(layer, "beta", i, 0.0);
  }
  if (name == "Normalization") {
    const double mean = element(layer, "mean", i, 0.0);
    const double deviation =
        std::fmax(std::sqrt(element(layer, "variance", i, 1.0)), kKerasLeastDeviation);
    return layer.number_or("invert", 0.0) != 0.0 ? x * deviation + mean : (x - mean) / deviation;
  }
  if (name == "Rescaling") {
    return x * element(layer, "scale", i, 1.0) + element(layer, "offset", i, 0.0);
  }
  if (name == "ReLU" && x < 0.0) return layer.number_or("negative_slope", 0.0) * x;
  if (name == "LeakyReLU" && x < 0.0) {
    return layer.number_or("negative_slope", layer.number_or("alpha", kKerasLeakySlope)) * x;
  }
  if (name == "PReLU" && x < 0.0) return element(layer, "alpha", i, 0.0) * x;
  return activated(layer.activation, x);
}

Values run_row(const KerasFile& file, std::vector<Values> window) {
  for (const KerasLayer& layer : file.layers) {
    if (layer.class_name == "GRU") {
      window = {run_gru(layer, window)};
      continue;
    }
    for (Values& values : window) {
      if (layer.class_name == "Dense") values = product(layer, "kernel", values, 0);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = one_by_one(layer, i, values[i]);
    }
  }
  return window.back();
}

}  // namespace

core::Result<Eigen::MatrixXd> run_keras(const KerasFile& file,
                                        std::span<const Eigen::MatrixXd> samples) {
  Eigen::MatrixXd result;
  for (Eigen::Index row = 0; row < samples.front().rows(); ++row) {
    std::vector<Values> window;
    for (const Eigen::MatrixXd& sample : samples) {
      const Eigen::RowVectorXd values = sample.row(row);
      window.emplace_back(values.begin(), values.end());
    }
    const Values outputs = run_row(file, std::move(window));
    if (row == 0) result.resize(samples.front().rows(), static_cast<Eigen::Index>(outputs.size()));
    if (static_cast<Eigen::Index>(outputs.size()) != result.cols())
      return core::data_error("rows of other widths");
    for (std::size_t k = 0; k < outputs.size(); ++k)
      result(row, static_cast<Eigen::Index>(k)) = outputs[k];
  }
  return result;
}

}  // namespace ravencal::conversion
