// SPDX-License-Identifier: Apache-2.0
#include "learn/ensemble.hpp"

#include <vector>

#include "core/require.hpp"
#include "model/jacobian.hpp"

namespace ravencal::learn {
namespace {

constexpr std::uint64_t kSeedStep = 10;

enum class Position { kFirst, kMiddle, kLast };

/// The `layer`-th layers of all models as one: stacked at the input, block-diagonal in the middle,
/// side by side with their mean at the output.
model::DenseLayer join(std::span<const model::CalibrationModel> models, std::size_t layer,
                       Position position) {
  const model::DenseLayer& first = models.front().layers[layer];
  const auto count = static_cast<Eigen::Index>(models.size());
  const Eigen::Index rows = first.weights.rows();
  const Eigen::Index columns = first.weights.cols();
  const Eigen::Index row_step = position == Position::kLast ? 0 : rows;
  const Eigen::Index column_step = position == Position::kFirst ? 0 : columns;
  const float share = position == Position::kLast ? 1.0F / static_cast<float>(count) : 1.0F;

  model::DenseLayer joined;
  joined.activation = first.activation;
  joined.weights.setZero(rows + (count - 1) * row_step, columns + (count - 1) * column_step);
  joined.biases.setZero(joined.weights.rows());
  for (Eigen::Index i = 0; i < count; ++i) {
    const model::DenseLayer& part = models[static_cast<std::size_t>(i)].layers[layer];
    joined.weights.block(i * row_step, i * column_step, rows, columns) += share * part.weights;
    joined.biases.segment(i * row_step, rows) += share * part.biases;
  }
  return joined;
}

}  // namespace

model::CalibrationModel average(std::span<const model::CalibrationModel> models) {
  core::require(!models.empty(), "an average needs a network");
  model::CalibrationModel mean = models.front();
  if (models.size() == 1 || mean.layers.size() < 2) return mean;
  const std::size_t last = mean.layers.size() - 1;
  for (std::size_t layer = 0; layer <= last; ++layer) {
    const Position position = layer == 0      ? Position::kFirst
                              : layer == last ? Position::kLast
                                              : Position::kMiddle;
    mean.layers[layer] = join(models, layer, position);
  }
  mean.provenance["networks_averaged"] = std::to_string(models.size());
  return mean;
}

core::Result<TrainResult> train_ensemble(
    std::span<const record::Recording* const> training,
    std::span<const record::Recording* const> validation, const TrainOptions& options,
    std::uint32_t networks, const std::function<bool(const EpochReport&)>& keep_going) {
  RAVENCAL_ASSIGN_OR_RETURN(TrainResult result,
                            train_model(training, validation, options, keep_going));
  std::vector<model::CalibrationModel> models = {result.model};
  TrainOptions next = options;
  while (models.size() < networks && !result.interrupted) {
    next.trainer.seed += kSeedStep;
    RAVENCAL_ASSIGN_OR_RETURN(const TrainResult more,
                              train_model(training, validation, next, keep_going));
    result.interrupted = more.interrupted;
    if (!more.interrupted) models.push_back(more.model);
  }
  result.model = average(models);
  result.model.loop_gains = model::loop_gains(result.model, result.drawn_rows);
  return result;
}

}  // namespace ravencal::learn
