// SPDX-License-Identifier: Apache-2.0
//
// The stretch of an axis, time or position, that a mismatch is limited to. A mismatch fills I if
// the plant, its constant and its tolerances fitted anew, is as good outside of I as any prediction
// is, and inside is not (a scan statistic after Kulldorff 1997, with the plant as the null).
// Fitting anew matters: a step or a bump bends the constant, so that it seems to be everywhere.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// Neighbouring cells of the axis, in its order.
struct ScanAxis {
  std::vector<Eigen::MatrixXd> moments;  ///< of [base target] in each cell
  std::vector<double> best;              ///< squared error of the best prediction there
  std::vector<double> rows;
};

/// What a row is worth: `variance` of the best prediction's error, and over how many rows it
/// resembles itself.
struct ScanNoise {
  double variance = 1.0;
  double correlation_rows = 1.0;
};

/// First and last cell of the stretch; all of them if the mismatch is everywhere. `prefer_later`:
/// of the two sides of a single change the later one is the mismatch. Nothing without cells.
std::optional<std::pair<std::size_t, std::size_t>> scan(const ScanAxis& axis,
                                                        const Eigen::VectorXd& precision,
                                                        const ScanNoise& noise, bool prefer_later);

}  // namespace ravencal::diagnose
