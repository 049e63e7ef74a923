// SPDX-License-Identifier: Apache-2.0
#include "model/jacobian.hpp"

#include <algorithm>

#include "model/activation_slope.hpp"
#include "model/layers.hpp"
#include "model/loop_group.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::model {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kBatch = 256;             // columns whose activations stay in the cache
constexpr double kDifferenceStep = 1e-4;  // of the input's scale

/// Zeroes the derivatives by inputs that are clamped; `by_input` is [features x rows].
void close_clamped(const ClampedRange& range, const Eigen::Ref<const MatrixXd>& rows_si,
                   MatrixXd& by_input) {
  for (Index i = 0; i < range.low.size(); ++i) {
    const auto low = static_cast<double>(range.low[i]);
    const auto high = static_cast<double>(range.high[i]);
    const auto values = rows_si.col(i).transpose().array();
    by_input.row(i).array() *= (values > low && values < high).cast<double>();
  }
}

/// Values of every layer behind its activation, the first those of the inputs.
std::vector<MatrixXd> forward(const CalibrationModel& model, MatrixXd inputs) {
  std::vector<MatrixXd> values = {std::move(inputs)};
  for (const DenseLayer& layer : model.layers) {
    MatrixXd sums(layer.weights.rows(), values.back().cols());
    dense(layer.weights.cast<double>(), layer.biases.cast<double>(), layer.activation,
          values.back(), sums);
    values.push_back(std::move(sums));
  }
  return values;
}

/// Appends the derivatives of one batch of rows.
void append_dense(const CalibrationModel& model, const Eigen::Ref<const MatrixXd>& rows_si,
                  std::vector<MatrixXd>& result) {
  const std::vector<MatrixXd> values =
      forward(model, scaled_inputs<double>(model, rows_si.transpose()));
  const ClampedRange range = clamped_range(model);
  const auto outputs = static_cast<Index>(model.outputs.size());
  const std::size_t first = result.size();
  for (Index row = 0; row < rows_si.rows(); ++row) result.emplace_back(outputs, rows_si.cols());
  for (Index k = 0; k < outputs; ++k) {
    MatrixXd back = MatrixXd::Zero(outputs, rows_si.rows());
    back.row(k).setConstant(model.output.scale[k]);
    for (std::size_t l = model.layers.size(); l-- > 0;) {
      const DenseLayer& layer = model.layers[l];
      const MatrixXd through =
          (back.array() * activation_slope(layer.activation, values[l + 1])).matrix();
      back = layer.weights.cast<double>().transpose() * through;
    }
    back = model.input.scale.cwiseInverse().asDiagonal() * back;
    close_clamped(range, rows_si, back);
    for (Index row = 0; row < rows_si.rows(); ++row) {
      result[first + static_cast<std::size_t>(row)].row(k) = back.col(row).transpose();
    }
  }
}

std::vector<MatrixXd> by_differences(const CalibrationModel& model, const MatrixXd& rows_si) {
  const auto outputs = static_cast<Index>(model.outputs.size());
  std::vector<MatrixXd> result(static_cast<std::size_t>(rows_si.rows()),
                               MatrixXd(outputs, rows_si.cols()));
  for (Index i = 0; i < rows_si.cols(); ++i) {
    const double step = kDifferenceStep * model.input.scale[i];
    MatrixXd above = rows_si;
    MatrixXd below = rows_si;
    above.col(i).array() += step;
    below.col(i).array() -= step;
    const MatrixXd slopes = (model.predict(above) - model.predict(below)) / (2.0 * step);
    for (Index row = 0; row < rows_si.rows(); ++row) {
      result[static_cast<std::size_t>(row)].col(i) = slopes.row(row).transpose();
    }
  }
  return result;
}

bool has_gru(const CalibrationModel& model) {
  return std::any_of(model.layers.begin(), model.layers.end(), [](const DenseLayer& layer) {
    return layer.kind != packed::LayerKind::kDense;
  });
}

/// Features that answer, channel by channel.
struct AnsweringChannel {
  std::string name;
  LoopGroup group;
  std::vector<Index> features;
};

std::vector<AnsweringChannel> answering_channels(const CalibrationModel& model) {
  std::vector<AnsweringChannel> channels;
  for (const std::size_t i : answering_features(model)) {
    const std::string& name = model.features[i].channel;
    auto known =
        std::find_if(channels.begin(), channels.end(),
                     [&](const AnsweringChannel& channel) { return channel.name == name; });
    if (known == channels.end()) {
      known = channels.insert(channels.end(), {name, *loop_group_of(name), {}});
    }
    known->features.push_back(static_cast<Index>(i));
  }
  return channels;
}

}  // namespace

std::vector<MatrixXd> jacobians(const CalibrationModel& model, const FeatureMatrix& rows_si) {
  if (has_gru(model)) return by_differences(model, rows_si.cast<double>());
  std::vector<MatrixXd> result;
  result.reserve(static_cast<std::size_t>(rows_si.rows()));
  for (Index begin = 0; begin < rows_si.rows(); begin += kBatch) {
    const Index count = std::min(kBatch, rows_si.rows() - begin);
    append_dense(model, rows_si.middleRows(begin, count).cast<double>(), result);
  }
  return result;
}

std::vector<std::size_t> answering_features(const CalibrationModel& model) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < model.features.size(); ++i) {
    if (loop_group_of(model.features[i].channel)) indices.push_back(i);
  }
  return indices;
}

FeatureMatrix evenly_drawn(const FeatureMatrix& rows, Index count) {
  if (rows.rows() <= count) return rows;
  FeatureMatrix drawn(count, rows.cols());
  for (Index i = 0; i < count; ++i) drawn.row(i) = rows.row(i * rows.rows() / count);
  return drawn;
}

LoopGains loop_gains(const CalibrationModel& model, const FeatureMatrix& rows_si) {
  const std::vector<AnsweringChannel> channels = answering_channels(model);
  const auto outputs = static_cast<Index>(model.outputs.size());
  LoopGains gains;
  gains.largest = MatrixXd::Zero(outputs, static_cast<Index>(channels.size()));
  gains.by_group = MatrixXd::Zero(outputs, kLoopGroupCount);
  for (const AnsweringChannel& channel : channels) gains.channels.push_back(channel.name);
  if (channels.empty()) return gains;
  const FeatureMatrix drawn = evenly_drawn(rows_si, kLoopGainRows);
  gains.rows = static_cast<std::uint32_t>(drawn.rows());
  for (const MatrixXd& slopes : jacobians(model, drawn)) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
      Eigen::VectorXd gain = Eigen::VectorXd::Zero(outputs);
      Eigen::VectorXd effect = Eigen::VectorXd::Zero(outputs);
      for (const Index i : channels[c].features) {
        gain += slopes.col(i).cwiseAbs();
        effect += slopes.col(i).cwiseAbs() * model.input.scale[i];
      }
      const auto group = static_cast<Index>(channels[c].group);
      auto largest = gains.largest.col(static_cast<Index>(c));
      largest = largest.cwiseMax(gain);
      gains.by_group.col(group) = gains.by_group.col(group).cwiseMax(effect);
    }
  }
  return gains;
}

}  // namespace ravencal::model
