// SPDX-License-Identifier: Apache-2.0
#include "model/unit_reduction.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/activation_slope.hpp"
#include "model/layers.hpp"

namespace ravencal::model {
namespace {

using Values = std::vector<Eigen::MatrixXd>;

/// Per layer, the mean of J' J over the rows, J the derivative of the outputs by the layer's sums:
/// a small change d of the sums changes the outputs by about d' (J' J) d in the mean square.
Values output_metrics(const CalibrationModel& model, const Values& values) {
  Values metrics;
  for (const DenseLayer& layer : model.layers) {
    metrics.emplace_back(Eigen::MatrixXd::Zero(layer.weights.rows(), layer.weights.rows()));
  }
  const auto rows = static_cast<double>(values[0].cols());
  for (Eigen::Index output = 0; output < values.back().rows(); ++output) {
    Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(values.back().rows(), values.back().cols());
    gradient.row(output).setOnes();
    for (std::size_t l = model.layers.size(); l-- > 0;) {
      const DenseLayer& layer = model.layers[l];
      const Eigen::MatrixXd at_sum =
          (activation_slope(layer.activation, values[l + 1]) * gradient.array()).matrix();
      metrics[l].selfadjointView<Eigen::Lower>().rankUpdate(at_sum, 1.0 / rows);
      if (l > 0) gradient = layer.weights.cast<double>().transpose() * at_sum;
    }
  }
  for (Eigen::MatrixXd& metric : metrics) {
    metric = Eigen::MatrixXd(metric.selfadjointView<Eigen::Lower>());
  }
  return metrics;
}

/// F with F F' = metric, without the directions that do not matter, [sums x few].
Eigen::MatrixXd root_of(const Eigen::MatrixXd& metric) {
  constexpr double kMatters = 1e-8;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(metric);
  const Eigen::VectorXd& values = solver.eigenvalues();
  const double least = kMatters * values.maxCoeff();
  const auto few = std::max<Eigen::Index>((values.array() > least).count(), 1);
  return solver.eigenvectors().rightCols(few) *
         values.tail(few).cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

UnitRanking rank_inputs(const DenseLayer& layer, const Eigen::MatrixXd& inputs,
                        const Eigen::MatrixXd& metric) {
  const Eigen::MatrixXd centred = inputs.colwise() - inputs.rowwise().mean();
  const Eigen::MatrixXd covariance =
      centred * centred.transpose() / static_cast<double>(inputs.cols());
  // The targets are F' W x, so that their covariances follow from that of x.
  const Eigen::MatrixXd weights = root_of(metric).transpose() * layer.weights.cast<double>();
  const Eigen::MatrixXd cross = covariance * weights.transpose();
  const double target_square = (weights.transpose().array() * cross.array()).sum();
  return rank_units(covariance, cross, target_square);
}

Eigen::MatrixXd sums_of(const DenseLayer& layer, const std::vector<Eigen::Index>& lanes,
                        const Eigen::MatrixXd& inputs) {
  const Eigen::MatrixXd weights = layer.weights(lanes, Eigen::all).cast<double>();
  const Eigen::VectorXd biases = layer.biases(lanes).cast<double>();
  return (weights * inputs).colwise() + biases;
}

/// Adds the positions of those kept that are means over travel; `kept` ascends.
void add_positions(std::vector<Eigen::Index>& kept, const std::vector<FeatureSpec>& features) {
  const std::vector<Eigen::Index> chosen = kept;
  for (const Eigen::Index i : chosen) {
    const FeatureSpec& feature = features[static_cast<std::size_t>(i)];
    if (!is_travel_mean(feature.transform)) continue;
    const auto position = position_of(features, feature);
    if (position) kept.push_back(static_cast<Eigen::Index>(*position));
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
}

}  // namespace

Values layer_values(const CalibrationModel& model, const Eigen::MatrixXd& scaled_inputs) {
  Values values = {scaled_inputs};
  for (const DenseLayer& layer : model.layers) {
    Eigen::MatrixXd y(layer.weights.rows(), scaled_inputs.cols());
    dense(layer.weights.cast<double>().eval(), layer.biases.cast<double>().eval(), layer.activation,
          values.back(), y);
    values.push_back(std::move(y));
  }
  return values;
}

double largest_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return std::sqrt((a - b).rowwise().squaredNorm().maxCoeff() / static_cast<double>(a.cols()));
}

void keep_inputs(CalibrationModel& model, const std::vector<Eigen::Index>& kept) {
  std::vector<FeatureSpec> features;
  for (const Eigen::Index i : kept) features.push_back(model.features[static_cast<std::size_t>(i)]);
  model.features = std::move(features);
  model.input.mean = model.input.mean(kept).eval();
  model.input.scale = model.input.scale(kept).eval();
  model.input_min = model.input_min(kept).eval();
  model.input_max = model.input_max(kept).eval();
  if (model.trust) {
    model.trust = marginal(*model.trust, std::vector<std::size_t>(kept.begin(), kept.end()));
  }
}

UnitReduction::UnitReduction(const CalibrationModel& model, Eigen::MatrixXd scaled_inputs)
    : model_(model), values_(layer_values(model, scaled_inputs)) {
  const Values metrics = output_metrics(model, values_);
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    rankings_.push_back(rank_inputs(model.layers[l], values_[l], metrics[l]));
  }
}

UnitReduction::Result UnitReduction::reduce(double level) const {
  std::vector<std::vector<Eigen::Index>> kept;
  for (const UnitRanking& ranking : rankings_) {
    kept.push_back(ranking.first_within(level * level));
    std::sort(kept.back().begin(), kept.back().end());
  }
  add_positions(kept.front(), model_.features);
  Result result{model_, kept.front(), 0.0};
  keep_inputs(result.model, kept.front());
  std::vector<Eigen::Index> outputs(static_cast<std::size_t>(values_.back().rows()));
  for (std::size_t j = 0; j < outputs.size(); ++j) outputs[j] = static_cast<Eigen::Index>(j);
  Eigen::MatrixXd x = values_[0](kept.front(), Eigen::all);
  for (std::size_t l = 0; l < model_.layers.size(); ++l) {
    const auto& lanes = l + 1 < kept.size() ? kept[l + 1] : outputs;
    const LinearFit fit = fit_linear_map(x, sums_of(model_.layers[l], lanes, values_[l]));
    DenseLayer& layer = result.model.layers[l];
    layer.weights = fit.weights.cast<float>();
    layer.biases = fit.biases.cast<float>();
    Eigen::MatrixXd y(fit.weights.rows(), x.cols());
    dense(layer.weights.cast<double>().eval(), layer.biases.cast<double>().eval(), layer.activation,
          x, y);
    x = std::move(y);
  }
  result.difference = largest_difference(x, values_.back());
  return result;
}

UnitReduction::Result UnitReduction::within(double budget) const {
  constexpr int kSteps = 12;
  std::vector<Eigen::Index> all(model_.features.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Eigen::Index>(i);
  Result best{model_, all, 0.0};
  double fits = std::log(budget) - 7.0;  // a thousandth of the budget
  double too_much = std::log(budget) + 1.0;
  for (int step = 0; step < kSteps; ++step) {
    const double middle = (fits + too_much) / 2.0;
    Result result = reduce(std::exp(middle));
    const bool accepted = result.difference <= budget;
    (accepted ? fits : too_much) = middle;
    if (accepted) best = std::move(result);
  }
  return best;
}

}  // namespace ravencal::model
