// SPDX-License-Identifier: Apache-2.0
//
// Fits a trust region (trust_region.hpp) to training rows. Not real time.
#pragma once

#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "model/trust_region.hpp"

namespace ravencal::model {

/// Share of the training rows that do not decide how far is full_distance: glitches.
inline constexpr double kDoubtedShare = 0.001;

/// Fits the region to the training rows `features_si` [rows x inputs], which must be finite, under
/// their own scaling `input`. One pass in double precision, in blocks; memory of inputs^2.
///   Rank: as few directions as hold 99 % of the variance, at most 16.
///   Variances: at least 0.001. Smaller ones are rounding of encoders and of single precision.
///   Distances: see fit_distances.
/// Constant inputs have no variance and no part in the directions.
TrustRegion fit_trust_region(const Standardiser& input, const FeatureMatrix& features_si);

/// Sets full_distance to three times the d2 that all but kDoubtedShare of `features_si` stay
/// within, because motion over whole joint ranges is sqrt(3) times as wide as a zig-zag's; from
/// four times that on (twice as far off in standard deviations) the confidence is 0.
void fit_distances(TrustRegion& region, const Standardiser& input,
                   const FeatureMatrix& features_si);

}  // namespace ravencal::model
