// SPDX-License-Identifier: Apache-2.0
//
// Quantiles of the standard normal distribution.
#pragma once

namespace ravencal::diagnose {

/// Deviations by which a mean exceeds a bound nine times in ten.
inline constexpr double kNineInTen = 1.28;
/// Deviations on either side of the mean that hold 95 %.
inline constexpr double kNormal95 = 1.96;

}  // namespace ravencal::diagnose
