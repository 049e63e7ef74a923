// SPDX-License-Identifier: Apache-2.0
//
// Network inputs of a whole recording, made by the same FeatureState that the plugin runs: one
// advance per row, reset at the recording's start and at every event of kind "episode".
#pragma once

#include <Eigen/Core>
#include <span>

#include "core/result.hpp"
#include "model/feature_spec.hpp"
#include "record/recording.hpp"

namespace ravencal::model {

/// One row per sample of the recording, one column per feature, in single precision as in the
/// robot; row-major, because FeatureState writes rows.
using FeatureMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// SI units. A lost value is NaN in its row, and in later rows that look back at it.
/// `row_period_s` is the unit of lags (of the rows that the model was trained on): in a recording
/// with another period a lag is rounded to the nearest row, at least 1. 0: one row is one row.
/// Means over time go by the time between the recording's own rows; a recording without times is
/// taken for one of `row_period_s`. Errors (kData): the recording lacks channels or positions of
/// means over travel, which are named; means over time of rows whose period nobody knows.
core::Result<FeatureMatrix> feature_matrix(std::span<const FeatureSpec> features,
                                           const record::Recording& recording,
                                           double row_period_s = 0.0);

/// Median time between rows, 0 if there are fewer than two or they carry no time.
double row_period_s(const record::Recording& recording);

}  // namespace ravencal::model
