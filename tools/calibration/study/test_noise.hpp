// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
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

/// What is known of each input of a network, over the rows that say how large noise is.
struct ColumnRanges {
  Eigen::VectorXd mean;       ///< [inputs], SI units, as the next
  Eigen::VectorXd deviation;  ///< 0 for a column that never changes
  Eigen::VectorXd least;
  Eigen::VectorXd greatest;
};
ColumnRanges ranges_of_training(const model::CalibrationModel& model);
/// Over all rows of the tests that have no NaN.
ColumnRanges ranges_of_tests(std::span<const model::FeatureMatrix* const> tests);

/// The inputs with these columns spoilt. Same seed, same values.
model::FeatureMatrix spoil(model::FeatureMatrix inputs, const ColumnRanges& ranges,
                           const std::vector<Eigen::Index>& columns, Noise noise,
                           std::uint64_t seed);

}  // namespace ravencal::study
