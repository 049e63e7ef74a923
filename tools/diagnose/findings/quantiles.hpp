// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::diagnose {

/// Deviations on either side of the mean that hold 95 % of a normal distribution.
inline constexpr double kNormal95 = 1.96;

}  // namespace ravencal::diagnose
