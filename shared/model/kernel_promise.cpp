// SPDX-License-Identifier: Apache-2.0
#include "model/kernel_promise.hpp"

#include <cmath>
#include <vector>

#include "model/activation_slope.hpp"
#include "model/layers.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::model {
namespace {

constexpr double kUnitRoundoff = 0x1p-24;  // of f32
constexpr double kMaxInputUnits = 32767.0;

/// Values in double precision and how far a kernel's may be from them.
struct Bounded {
  Eigen::MatrixXd value;
  Eigen::MatrixXd error;

  [[nodiscard]] Eigen::ArrayXXd size() const { return value.array().abs() + error.array(); }
};

/// Largest relative error of a result that was rounded so often.
double accumulated(Eigen::Index roundings) {
  const double sum = static_cast<double>(roundings) * kUnitRoundoff;
  return sum / (1.0 - sum);
}

Bounded bounded_inputs(const CalibrationModel& model, const Eigen::MatrixXf& features_si) {
  // Difference, product and the inverse of the scale are rounded, and so is the mean.
  const Eigen::ArrayXd mean_error = model.input.mean.array().abs() * kUnitRoundoff;
  const Eigen::ArrayXd inverse_scale = model.input.scale.array().inverse();
  const Eigen::MatrixXd from_mean =
      clamped_inputs<double>(model, features_si.cast<double>()).colwise() - model.input.mean;
  Bounded x;
  x.value = (from_mean.array().colwise() * inverse_scale).matrix();
  x.error =
      (((from_mean.array().abs().colwise() + mean_error) * accumulated(3)).colwise() + mean_error)
          .colwise() *
      inverse_scale;
  return x;
}

/// Rounded to whole steps as int8 layers do it. An error moves a value at most over the boundaries
/// within its reach, each worth a step.
Bounded quantised(const Bounded& x, double step) {
  const auto rounded = [](const Eigen::ArrayXXd& units) -> Eigen::ArrayXXd {
    return units.rint().max(-kMaxInputUnits).min(kMaxInputUnits);
  };
  const Eigen::ArrayXXd units = x.value.array() / step;
  // The inverse of the step and the product are rounded.
  const Eigen::ArrayXXd reach = x.size() / step * accumulated(2) + x.error.array() / step;
  const Eigen::ArrayXXd nearest = rounded(units);
  const Eigen::ArrayXXd up = rounded(units + reach) - nearest;
  const Eigen::ArrayXXd down = nearest - rounded(units - reach);
  return {(nearest * step).matrix(), (up.max(down) * step).matrix()};
}

/// weights * x + biases.
Bounded sums(const DenseLayer& layer, const Bounded& x) {
  const Eigen::MatrixXd weights = layer.weights.cast<double>();
  const Eigen::VectorXd biases = layer.biases.cast<double>();
  Bounded y;
  y.value = (weights * x.value).colwise() + biases;
  const Eigen::MatrixXd products =
      (weights.cwiseAbs() * x.size().matrix()).colwise() + biases.cwiseAbs();
  y.error = weights.cwiseAbs() * x.error + accumulated(roundings_of_sum(layer)) * products;
  return y;
}

/// What the kernel's activation adds to the error of its argument.
double error_of(Activation activation) {
  if (activation == Activation::kSigmoid) return kSigmoidError;
  return activation == Activation::kTanh ? kTanhError : 0.0;
}

/// The steepest that the activation is within the errors of its arguments.
Eigen::MatrixXd largest_slope(Activation activation, const Bounded& z) {
  if (activation == Activation::kLinear || activation == Activation::kRelu) {
    const bool may_pass = activation == Activation::kRelu;
    const Eigen::ArrayXXd one = Eigen::ArrayXXd::Ones(z.value.rows(), z.value.cols());
    const Eigen::ArrayXXd open = (z.value.array() + z.error.array() > 0.0).cast<double>();
    return (may_pass ? open : one).matrix();
  }
  // Both slopes fall with the distance from zero: the largest is at the near end of the error.
  Eigen::MatrixXd nearest = (z.value.array().abs() - z.error.array()).max(0.0).matrix();
  activate(activation, nearest);
  return activation_slope(activation, nearest).matrix();
}

Bounded activated(Activation activation, const Bounded& z) {
  Bounded y = z;
  activate(activation, y.value);
  y.error = z.error.cwiseProduct(largest_slope(activation, z));
  y.error.array() += error_of(activation);
  return y;
}

Bounded sum(const Bounded& a, const Bounded& b) {
  return {a.value + b.value,
          (a.error.array() + b.error.array() + (a.size() + b.size()) * accumulated(1)).matrix()};
}

Bounded product(const Bounded& a, const Bounded& b) {
  const Eigen::ArrayXXd errors =
      a.error.array() * b.size() + a.value.array().abs() * b.error.array();
  return {a.value.cwiseProduct(b.value), (errors + a.size() * b.size() * accumulated(1)).matrix()};
}

/// State of a GRU behind a window of samples that are all x (layers.hpp, gru_held).
Bounded held_state(const DenseLayer& projection, const DenseLayer& recurrent, const Bounded& x) {
  const Eigen::Index units = recurrent.weights.cols();
  const Eigen::Index block = recurrent.weights.rows() / 3;
  const Bounded from_input = sums(projection, x);
  const auto part = [&](const Bounded& all, Eigen::Index g) {
    return Bounded{all.value.middleRows(g * block, units), all.error.middleRows(g * block, units)};
  };
  Bounded state{Eigen::MatrixXd::Zero(units, x.value.cols()),
                Eigen::MatrixXd::Zero(units, x.value.cols())};
  for (int sample = 0; sample < recurrent.window; ++sample) {
    const Bounded from_state = sums(recurrent, state);
    const auto gate = [&](Eigen::Index g) {
      return activated(Activation::kSigmoid, sum(part(from_input, g), part(from_state, g)));
    };
    const Bounded update = gate(0);
    const Bounded candidate = activated(
        Activation::kTanh, sum(part(from_input, 2), product(gate(1), part(from_state, 2))));
    // candidate + update * (state - candidate), where an error of the candidate counts once.
    const Eigen::ArrayXXd share = update.value.array();
    const Eigen::ArrayXXd change = (state.value - candidate.value).array();
    const Eigen::ArrayXXd errors = state.error.array() + candidate.error.array();
    const Eigen::ArrayXXd sizes =
        candidate.size() + update.size() * (state.size() + candidate.size());
    state.error = ((1.0 - share) * candidate.error.array() + share * state.error.array() +
                   update.error.array() * (change.abs() + errors) + sizes * accumulated(3))
                      .matrix();
    state.value = (candidate.value.array() + share * change).matrix();
  }
  return state;
}

/// A dense layer on the samples, and what enters there that was exact before.
struct Step {
  const DenseLayer* layer;
  bool is_source;               ///< the errors of its inputs begin here
  Eigen::MatrixXd input_error;  ///< [inputs x samples]
  Eigen::MatrixXd sum_error;    ///< [outputs x samples], of exact inputs
  Eigen::MatrixXd slope;        ///< [outputs x samples]
};

/// Errors of the last layer's outputs for one sample: each error times the derivative of the output
/// by what it changes. To first order, and with signs, so that what cancels between layers does;
/// bounds that go from layer to layer grow with the product of their row sums instead.
Eigen::VectorXd carried(const std::vector<Step>& steps, Eigen::Index sample) {
  constexpr double kSecondOrder = 1.01;  // errors are millionths of a unit's range
  const Eigen::Index outputs = steps.back().layer->weights.rows();
  Eigen::MatrixXd derivative = Eigen::MatrixXd::Identity(outputs, outputs);
  Eigen::VectorXd error = Eigen::VectorXd::Zero(outputs);
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    error += derivative.cwiseAbs().rowwise().sum() * error_of(step->layer->activation);
    derivative = derivative * step->slope.col(sample).asDiagonal();
    error += derivative.cwiseAbs() * step->sum_error.col(sample);
    derivative = derivative * step->layer->weights.cast<double>();
    if (!step->is_source) continue;
    error += derivative.cwiseAbs() * step->input_error.col(sample);
    break;  // behind rounded inputs nothing else arrives
  }
  return kSecondOrder * error;
}

}  // namespace

Eigen::Index roundings_of_sum(const DenseLayer& layer) {
  constexpr Eigen::Index kProductAndBias = 2;
  const Eigen::Index inputs = layer.weights.cols();
  // A row's lanes each take every 16th product; then the lanes are added up.
  if (layer.weights.rows() <= packed::kFewOutputs) {
    constexpr Eigen::Index kLanes = packed::kLineLanes;
    return (inputs + kLanes - 1) / kLanes + kLanes + kProductAndBias;
  }
  // Sums of integers are exact: what is rounded is the weight's unit, as stored and as read back
  // (twice), the sum, its product with the unit, and the bias.
  const bool is_exact = layer.input_step > 0.0F && layer.kind != packed::LayerKind::kGruRecurrent;
  if (is_exact) return 6;
  // Up to 8 sums side by side are added up at the end. A GRU's recurrent sums take two roundings
  // of their unit.
  return inputs + 8 + 2 + kProductAndBias;
}

KernelPromise kernel_promise(const CalibrationModel& model, const Eigen::MatrixXf& features_si) {
  std::vector<Step> steps;
  Bounded x = bounded_inputs(model, features_si);
  for (const DenseLayer& layer : model.layers) {
    if (layer.kind == packed::LayerKind::kGruRecurrent) continue;  // went with the one before
    const bool is_rounded = layer.input_step > 0.0F;
    if (is_rounded) x = quantised(x, static_cast<double>(layer.input_step));
    if (layer.kind == packed::LayerKind::kGruInput) {
      x = held_state(layer, *(&layer + 1), x);
      continue;
    }
    const bool is_source = steps.empty() || is_rounded;
    const Bounded exact{x.value, Eigen::MatrixXd::Zero(x.error.rows(), x.error.cols())};
    const Bounded z = sums(layer, x);
    steps.push_back(
        {&layer, is_source, x.error, sums(layer, exact).error, largest_slope(layer.activation, z)});
    x = activated(layer.activation, z);
  }
  // Scale, mean, product and sum are rounded.
  const Eigen::ArrayXd scale = model.output.scale.array();
  const Eigen::ArrayXd mean = model.output.mean.array();
  KernelPromise promise;
  promise.outputs = ((x.value.array().colwise() * scale).colwise() + mean).matrix();
  promise.error =
      (((x.value.array().abs().colwise() * scale).colwise() + mean.abs()) * accumulated(4))
          .matrix();
  for (Eigen::Index sample = 0; sample < features_si.cols(); ++sample) {
    promise.error.col(sample) += model.output.scale.cwiseProduct(carried(steps, sample));
  }
  return promise;
}

}  // namespace ravencal::model
