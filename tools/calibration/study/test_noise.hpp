// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "study/ablation_rows.hpp"

namespace ravencal::study {

/// Columns of the model's inputs that the terms select among its own channels, lags and play
/// operators included; a term that selects none of them is passed over.
std::vector<Eigen::Index> columns_of(const model::CalibrationModel& model,
                                     const std::vector<record::Channel>& channels,
                                     const std::vector<std::string>& terms);

/// The inputs with these columns spoilt. Same seed, same values.
model::FeatureMatrix spoil(model::FeatureMatrix inputs, const model::CalibrationModel& model,
                           const std::vector<Eigen::Index>& columns, Noise noise,
                           std::uint64_t seed);

}  // namespace ravencal::study
