// SPDX-License-Identifier: Apache-2.0
//
// Several networks that differ only in their seed, averaged. The mean of the predictions is itself
// one network (layers side by side), so an ensemble is stored, converted and run as any model.
#pragma once

#include <functional>
#include <span>

#include "learn/train.hpp"

namespace ravencal::learn {

/// One model whose prediction is the mean of those of `models` (>= 1), which must share features,
/// scaling, outputs and layer count, as networks trained on the same rows do. A hidden layer of
/// width w becomes one of width models.size() * w.
model::CalibrationModel average(std::span<const model::CalibrationModel> models);

/// train_model once per seed: options.trainer.seed, then every 10 on (the paper's seeds are
/// 10 i + 3). The result holds the averaged model; its epochs are those of the first network.
core::Result<TrainResult> train_ensemble(std::span<const record::Recording* const> training,
                                         std::span<const record::Recording* const> validation,
                                         const TrainOptions& options, std::uint32_t networks,
                                         const std::function<bool(const EpochReport&)>& keep_going);

}  // namespace ravencal::learn
