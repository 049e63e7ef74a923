// SPDX-License-Identifier: Apache-2.0
#include "model/compact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/layers.hpp"
#include "model/scaled_inputs.hpp"
#include "model/trust_fit.hpp"
#include "model/unit_reduction.hpp"

namespace ravencal::model {
namespace {

/// Rows on which a removal is judged, spread evenly over those given: enough for the statistics of
/// 600 units, and few enough for the paper's network to take seconds.
constexpr Eigen::Index kMostRows = 8192;

/// What stays, and the constant that replaces what is removed, per layer and input of that layer
/// (input 0 of layer 0 is the first feature; input i of layer l is unit i of layer l - 1).
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
  keep_inputs(small, kept(selection.keep[0]));
  return small;
}

/// The value of an input or unit that is always the same, whatever the robot does: the plugin
/// clamps an input that never changed in training to what it was.
bool is_constant(const CalibrationModel& model, std::size_t layer, Eigen::Index i, double& value) {
  if (layer == 0) {
    value = (model.input_min[i] - model.input.mean[i]) / model.input.scale[i];
    return model.input_min[i] == model.input_max[i];
  }
  const DenseLayer& before = model.layers[layer - 1];
  Eigen::Matrix<double, 1, 1> unit(static_cast<double>(before.biases[i]));
  activate(before.activation, unit);
  value = unit[0];
  return before.weights.row(i).isZero(0.0F);
}

/// Drops once what no input can influence.
bool drop_exact(CalibrationModel& model, std::vector<std::size_t>& inputs) {
  Selection selection = keep_all(model);
  bool dropped = false;
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    auto& keep = selection.keep[l];
    auto remaining = static_cast<Eigen::Index>(keep.size());
    for (Eigen::Index i = 0; i < model.layers[l].weights.cols() && remaining > 1; ++i) {
      double value = 0.0;
      const bool constant = is_constant(model, l, i, value);
      if (!constant && !model.layers[l].weights.col(i).isZero(0.0F)) continue;
      if (l == 0 && is_needed_position(model.features, static_cast<std::size_t>(i))) continue;
      selection.value[l][i] = constant ? value : 0.0;
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

/// At most kMostRows rows, scaled, [inputs x rows].
Eigen::MatrixXd scaled_sample(const CalibrationModel& model, const FeatureMatrix& features_si) {
  const Eigen::Index step =
      std::max<Eigen::Index>(1, (features_si.rows() + kMostRows - 1) / kMostRows);
  const Eigen::Index rows = (features_si.rows() + step - 1) / step;
  return scaled_inputs<double>(
      model, features_si(Eigen::seqN(0, rows, step), Eigen::all).transpose().cast<double>());
}

core::Status check(const CalibrationModel& model, const FeatureMatrix& features_si,
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
  return {};
}

}  // namespace

core::Result<Compacted> compact(const CalibrationModel& model, const FeatureMatrix& features_si,
                                const CompactOptions& options) {
  RAVENCAL_RETURN_IF_ERROR(check(model, features_si, options));
  Compacted result;
  result.model = model;
  result.weights_before = weight_count(model);
  for (std::size_t i = 0; i < model.features.size(); ++i) result.kept_inputs.push_back(i);
  while (drop_exact(result.model, result.kept_inputs)) {
  }
  if (features_si.rows() > 0) {
    const Eigen::MatrixXd all_inputs = scaled_sample(model, features_si);
    if (options.budget > 0.0) {
      const UnitReduction reduction(result.model, all_inputs(result.kept_inputs, Eigen::all));
      UnitReduction::Result small = reduction.within(options.budget);
      std::vector<std::size_t> left;
      for (const Eigen::Index i : small.kept_inputs) {
        left.push_back(result.kept_inputs[static_cast<std::size_t>(i)]);
      }
      result.kept_inputs = std::move(left);
      result.model = std::move(small.model);
    }
    result.output_change = largest_difference(
        layer_values(result.model, all_inputs(result.kept_inputs, Eigen::all)).back(),
        layer_values(model, all_inputs).back());
    if (result.model.trust) {
      fit_distances(*result.model.trust, result.model.input,
                    clamped_inputs<float>(result.model,
                                          features_si(Eigen::all, result.kept_inputs).transpose())
                        .transpose());
    }
  }
  result.weights_after = weight_count(result.model);
  return result;
}

}  // namespace ravencal::model
