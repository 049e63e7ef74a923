// SPDX-License-Identifier: Apache-2.0
//
// Quantiles of the standard normal distribution, and Student's over them.
#pragma once

namespace ravencal::diagnose {

/// Deviations on either side of the mean that hold 95 %.
inline constexpr double kNormal95 = 1.96;

/// Student's 97.5 % quantile over a normal's (Cornish and Fisher).
inline double student_per_normal95(double degrees) {
  const double z2 = kNormal95 * kNormal95;
  return 1.0 + (z2 + 1.0) / (4.0 * degrees) +
         (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / (96.0 * degrees * degrees);
}

}  // namespace ravencal::diagnose
