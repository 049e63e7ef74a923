// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

namespace ravencal::physics {

/// Elastic-slip element (stop operator): it follows a motion until it is deflected by `limit` and
/// slips from there on. Deflection after a further motion by `moved`; all in one unit.
inline double slipped(double deflection, double moved, double limit = 1.0) {
  return std::clamp(deflection + moved, -limit, limit);
}

/// Widths of the elements of a hysteresis that is given by its loop, as shares of its width.
inline constexpr std::array kLoopWidths = {1.0 / 3.0, 1.0, 3.0};

}  // namespace ravencal::physics
