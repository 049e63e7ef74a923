// SPDX-License-Identifier: Apache-2.0
//
// Positions that start again after a turn, told by their values. Private to guess/.
#pragma once

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <string_view>

namespace ravencal::guess {

inline constexpr double kTurnRad = 2.0 * std::numbers::pi;
/// Rounding of a text moves the ends of a range by so much of it.
inline constexpr double kRangeRounding = 1e-4;

/// After how much the values start again; nothing where they go on. Widths that counters have are
/// known; another one is taken from several starts that agree. `unit`: of the name, may be empty.
struct Wrap {
  double width = 0.0;
  bool estimated = false;  ///< from the values: no counter is known to have that width
};
std::optional<Wrap> wrap_of(const Eigen::VectorXd& values, bool whole_numbers,
                            std::string_view unit);

}  // namespace ravencal::guess
