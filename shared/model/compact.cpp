// SPDX-License-Identifier: Apache-2.0
#include "model/compact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/layers.hpp"

namespace ravencal::model {
namespace {

/// Rows that judge a removal, spread evenly over those given: enough for a mean, few enough that
/// the paper's network takes seconds.
constexpr Eigen::Index kMostRows = 4096;

/// What stays, and the value that stands for what goes, per layer and input of that layer (input 0
/// of layer 0 is the first feature; input i of layer l is unit i of layer l - 1).
struct Selection {
  std::vector<std::vector<bool>> keep;
  std::vector<Eigen::VectorXd> value;
};

Selection keep_all(const CalibrationModel& model) {
  Selection all;
  for (const DenseLayer& layer : model.layers) {
    all.keep.emplace_back(layer.weights.cols(), true);
    all.value.emplace_back(Eigen::VectorXd::Zero(layer.weights.cols()));
  }
  return all;
}

std::vector<Eigen::Index> kept(const std::vector<bool>& keep) {
  std::vector<Eigen::Index> indices;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) indices.push_back(static_cast<Eigen::Index>(i));
  }
  return indices;
}

std::size_t weight_count(const CalibrationModel& model) {
  Eigen::Index count = 0;
  for (const DenseLayer& layer : model.layers) count += layer.weights.size();
  return static_cast<std::size_t>(count);
}

/// The model without what the selection drops.
CalibrationModel reduced(const CalibrationModel& model, const Selection& selection) {
  CalibrationModel small = model;
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    const DenseLayer& layer = model.layers[l];
    Eigen::VectorXd biases = layer.biases.cast<double>();
    for (Eigen::Index i = 0; i < layer.weights.cols(); ++i) {
      if (!selection.keep[l][static_cast<std::size_t>(i)]) {
        biases += layer.weights.col(i).cast<double>() * selection.value[l][i];
      }
    }
    const Eigen::MatrixXf columns = layer.weights(Eigen::all, kept(selection.keep[l]));
    if (l + 1 < model.layers.size()) {
      const auto rows = kept(selection.keep[l + 1]);
      small.layers[l].weights = columns(rows, Eigen::all);
      small.layers[l].biases = biases(rows).cast<float>();
    } else {
      small.layers[l].weights = columns;
      small.layers[l].biases = biases.cast<float>();
    }
  }
  const auto inputs = kept(selection.keep[0]);
  small.features.clear();
  for (const Eigen::Index i : inputs)
    small.features.push_back(model.features[static_cast<std::size_t>(i)]);
  small.input.mean = model.input.mean(inputs);
  small.input.scale = model.input.scale(inputs);
  small.input_min = model.input_min(inputs);
  small.input_max = model.input_max(inputs);
  return small;
}

/// Values of every layer's inputs, and of the outputs, [units x rows], in the network's scaling.
std::vector<Eigen::MatrixXd> values_of(const CalibrationModel& model,
                                       const Eigen::MatrixXd& scaled_inputs) {
  std::vector<Eigen::MatrixXd> values = {scaled_inputs};
  for (const DenseLayer& layer : model.layers) {
    Eigen::MatrixXd y(layer.weights.rows(), scaled_inputs.cols());
    dense(layer.weights.cast<double>().eval(), layer.biases.cast<double>().eval(), layer.activation,
          values.back(), y);
    values.push_back(std::move(y));
  }
  return values;
}

/// Derivative of an activation, from its result.
Eigen::ArrayXXd slope(Activation activation, const Eigen::MatrixXd& y) {
  switch (activation) {
    case Activation::kLinear:
      break;
    case Activation::kSigmoid:
      return y.array() * (1.0 - y.array());
    case Activation::kTanh:
      return 1.0 - y.array().square();
    case Activation::kRelu:
      return (y.array() > 0.0).cast<double>();
  }
  return Eigen::ArrayXXd::Ones(y.rows(), y.cols());
}

/// To first order, the root mean square change of the output that suffers most when an input of a
/// layer is replaced by its mean.
std::vector<Eigen::VectorXd> removal_costs(const CalibrationModel& model,
                                           const std::vector<Eigen::MatrixXd>& values) {
  std::vector<Eigen::VectorXd> costs;
  for (const DenseLayer& layer : model.layers)
    costs.emplace_back(Eigen::VectorXd::Zero(layer.weights.cols()));
  const auto rows = static_cast<double>(values[0].cols());
  for (Eigen::Index output = 0; output < values.back().rows(); ++output) {
    Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(values.back().rows(), values.back().cols());
    gradient.row(output).setOnes();
    for (std::size_t l = model.layers.size(); l-- > 0;) {
      const DenseLayer& layer = model.layers[l];
      const Eigen::MatrixXd at_sum =
          (slope(layer.activation, values[l + 1]) * gradient.array()).matrix();
      gradient = layer.weights.cast<double>().transpose() * at_sum;
      const Eigen::VectorXd mean = values[l].rowwise().mean();
      const Eigen::MatrixXd change =
          (gradient.array() * (values[l].colwise() - mean).array()).matrix();
      costs[l] = costs[l].cwiseMax((change.rowwise().squaredNorm() / rows).cwiseSqrt());
    }
  }
  return costs;
}

/// Drops what no input can make matter, once.
bool drop_exact(CalibrationModel& model, std::vector<std::size_t>& inputs) {
  Selection selection = keep_all(model);
  bool dropped = false;
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    auto& keep = selection.keep[l];
    auto remaining = static_cast<Eigen::Index>(keep.size());
    for (Eigen::Index i = 0; i < model.layers[l].weights.cols() && remaining > 1; ++i) {
      const bool unread = model.layers[l].weights.col(i).isZero(0.0F);
      const bool constant = l > 0 && model.layers[l - 1].weights.row(i).isZero(0.0F);
      if (!unread && !constant) continue;
      if (constant) {
        Eigen::Matrix<double, 1, 1> value(static_cast<double>(model.layers[l - 1].biases[i]));
        activate(model.layers[l - 1].activation, value);
        selection.value[l][i] = value[0];
      }
      keep[static_cast<std::size_t>(i)] = false;
      --remaining;
      dropped = true;
    }
  }
  if (!dropped) return false;
  std::vector<std::size_t> left;
  for (const Eigen::Index i : kept(selection.keep[0]))
    left.push_back(inputs[static_cast<std::size_t>(i)]);
  inputs = std::move(left);
  model = reduced(model, selection);
  return true;
}

struct Candidate {
  double cost;
  std::size_t layer;
  std::size_t index;
};

std::vector<Candidate> cheapest_first(const std::vector<Eigen::VectorXd>& costs) {
  std::vector<Candidate> candidates;
  for (std::size_t l = 0; l < costs.size(); ++l) {
    Eigen::Index costliest = 0;
    costs[l].maxCoeff(&costliest);
    for (Eigen::Index i = 0; i < costs[l].size(); ++i) {
      if (i != costliest) candidates.push_back({costs[l][i], l, static_cast<std::size_t>(i)});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  return candidates;
}

/// Largest root mean square difference of an output; the network's outputs have unit scale.
double difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return std::sqrt((a - b).rowwise().squaredNorm().maxCoeff() / static_cast<double>(a.cols()));
}

Eigen::MatrixXd outputs_of(const CalibrationModel& model, const Selection& selection,
                           const Eigen::MatrixXd& scaled_inputs) {
  return values_of(reduced(model, selection), scaled_inputs(kept(selection.keep[0]), Eigen::all))
      .back();
}

/// Drops as many of the cheapest as keep the outputs within the budget of `truth`.
Selection within_budget(const CalibrationModel& model, const Eigen::MatrixXd& scaled_inputs,
                        const Eigen::MatrixXd& truth, double budget) {
  const auto values = values_of(model, scaled_inputs);
  const auto candidates = cheapest_first(removal_costs(model, values));
  const auto without_first = [&](std::size_t count) {
    Selection selection = keep_all(model);
    for (std::size_t l = 0; l < model.layers.size(); ++l) {
      selection.value[l] = values[l].rowwise().mean();
    }
    for (std::size_t c = 0; c < count; ++c)
      selection.keep[candidates[c].layer][candidates[c].index] = false;
    return selection;
  };
  std::size_t fits = 0;
  std::size_t too_many = candidates.size() + 1;
  while (too_many - fits > 1) {
    const std::size_t middle = fits + (too_many - fits) / 2;
    const auto outputs = outputs_of(model, without_first(middle), scaled_inputs);
    (difference(outputs, truth) <= budget ? fits : too_many) = middle;
  }
  return without_first(fits);
}

/// At most kMostRows rows, scaled and transposed.
Eigen::MatrixXd scaled_sample(const CalibrationModel& model, const Eigen::MatrixXd& features_si) {
  const Eigen::Index step =
      std::max<Eigen::Index>(1, (features_si.rows() + kMostRows - 1) / kMostRows);
  const Eigen::Index rows = (features_si.rows() + step - 1) / step;
  const Eigen::MatrixXd sample = features_si(Eigen::seqN(0, rows, step), Eigen::all).transpose();
  Eigen::MatrixXd scaled(sample.rows(), sample.cols());
  standardise(model.input.mean, model.input.scale.cwiseInverse().eval(), sample, scaled);
  return scaled;
}

}  // namespace

core::Result<Compacted> compact(const CalibrationModel& model, const Eigen::MatrixXd& features_si,
                                const CompactOptions& options) {
  const auto width = static_cast<Eigen::Index>(model.features.size());
  if (features_si.rows() > 0 && features_si.cols() != width) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("the rows to compact with have {} features, the model has {}",
                                   features_si.cols(), width)};
  }
  if (features_si.rows() == 0 && options.budget > 0.0) {
    return core::Error{core::ErrorCode::kUsage,
                       "compacting within a budget needs recorded rows to measure the change on"};
  }
  if (!features_si.allFinite()) {
    return core::Error{core::ErrorCode::kData,
                       "a row to compact with holds a value that is not finite"};
  }
  Compacted result;
  result.model = model;
  result.weights_before = weight_count(model);
  for (std::size_t i = 0; i < model.features.size(); ++i) result.kept_inputs.push_back(i);
  const auto drop_exactly = [&] {
    while (drop_exact(result.model, result.kept_inputs)) {
    }
  };
  drop_exactly();
  if (features_si.rows() > 0) {
    const Eigen::MatrixXd all_inputs = scaled_sample(model, features_si);
    const Eigen::MatrixXd truth = values_of(model, all_inputs).back();
    if (options.budget > 0.0) {
      const auto selection = within_budget(result.model, all_inputs(result.kept_inputs, Eigen::all),
                                           truth, options.budget);
      std::vector<std::size_t> left;
      for (const Eigen::Index i : kept(selection.keep[0])) {
        left.push_back(result.kept_inputs[static_cast<std::size_t>(i)]);
      }
      result.kept_inputs = std::move(left);
      result.model = reduced(result.model, selection);
      drop_exactly();
    }
    const Eigen::MatrixXd inputs = all_inputs(result.kept_inputs, Eigen::all);
    result.output_change = difference(values_of(result.model, inputs).back(), truth);
  }
  result.weights_after = weight_count(result.model);
  return result;
}

}  // namespace ravencal::model
