// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::physics {

/// Gap of +-half_width between drive and joint, in series with the cable's spring: inside it no
/// effort passes; outside, the spring sees what is left of the stretch. Units: the joint's.
constexpr double through_gap(double stretch, double half_width) {
  if (stretch > half_width) return stretch - half_width;
  if (stretch < -half_width) return stretch + half_width;
  return 0.0;
}

}  // namespace ravencal::physics
