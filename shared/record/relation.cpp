// SPDX-License-Identifier: Apache-2.0
#include "record/relation.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

namespace ravencal::record {
namespace {

using Eigen::VectorXd;

/// Rows of a window: long enough that a change of position stands above its quantisation, short
/// enough that a window holds a part of one stroke at 50 Hz and more.
constexpr Eigen::Index kWindowRows = 8;

VectorXd of(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// Rounding of a text leaves less of a computed column's variance than that, noise of a second
/// encoder leaves more.
constexpr double kRoundingShare = 1e-7;

/// Friction and inertia tell an effort's sign where they make at least that share of its variance.
constexpr double kLeastByMotion = 0.1;

double mean_square(const VectorXd& values) {
  return (values.array() - values.mean()).square().mean();
}

}  // namespace

std::optional<Line> line_through(const VectorXd& x, const VectorXd& y) {
  std::vector<double> kept_x, kept_y;
  for (Eigen::Index row = 0; row < x.size(); ++row) {
    if (!std::isfinite(x[row]) || !std::isfinite(y[row])) continue;
    kept_x.push_back(x[row]);
    kept_y.push_back(y[row]);
  }
  const VectorXd a = of(kept_x), b = of(kept_y);
  if (a.size() < kFewestRows) return std::nullopt;
  const double xx = mean_square(a), yy = mean_square(b);
  if (!(xx > 0.0) || !(yy > 0.0)) return std::nullopt;
  const double xy = ((a.array() - a.mean()) * (b.array() - b.mean())).mean();
  const double slope = xy / xx;
  return Line{slope, b.mean() - slope * a.mean(), xy / std::sqrt(xx * yy)};
}

std::optional<Line> derivative_line(const VectorXd& t_s, const VectorXd& position,
                                    const VectorXd& velocity) {
  const Eigen::Index windows = t_s.size() / kWindowRows;
  VectorXd travel(windows), integral = VectorXd::Zero(windows);
  for (Eigen::Index w = 0; w < windows; ++w) {
    const Eigen::Index from = w * kWindowRows;
    const Eigen::Index to = std::min(from + kWindowRows, t_s.size() - 1);
    travel[w] = position[to] - position[from];
    for (Eigen::Index row = from; row < to; ++row)
      integral[w] += 0.5 * (velocity[row] + velocity[row + 1]) * (t_s[row + 1] - t_s[row]);
  }
  return line_through(integral, travel);
}

std::optional<EffortFit> effort_of_motion(const VectorXd& t_s, const VectorXd& position,
                                          const VectorXd& effort) {
  // One row a window: differences over whole windows, in which quantisation is small.
  std::vector<std::array<double, 6>> rows;
  std::vector<double> targets;
  for (Eigen::Index row = kWindowRows; row + kWindowRows < t_s.size(); row += kWindowRows) {
    const double before_s = t_s[row] - t_s[row - kWindowRows];
    const double after_s = t_s[row + kWindowRows] - t_s[row];
    if (!(before_s > 0.0) || !(after_s > 0.0)) continue;
    const double before = (position[row] - position[row - kWindowRows]) / before_s;
    const double after = (position[row + kWindowRows] - position[row]) / after_s;
    const double velocity = 0.5 * (before + after);
    const double acceleration = 2.0 * (after - before) / (before_s + after_s);
    const double q = position[row];
    if (!std::isfinite(acceleration) || !std::isfinite(effort[row])) continue;
    rows.push_back({1.0, std::sin(q), std::cos(q), velocity, acceleration,
                    static_cast<double>((velocity > 0.0) - (velocity < 0.0))});
    targets.push_back(effort[row]);
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (count < kFewestRows) return std::nullopt;
  Eigen::MatrixXd matrix(count, 6);
  for (Eigen::Index r = 0; r < count; ++r)
    for (Eigen::Index c = 0; c < 6; ++c)
      matrix(r, c) = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  const VectorXd target = of(targets);
  const double all = mean_square(target);
  if (!(all > 0.0)) return std::nullopt;
  const VectorXd weights = matrix.colPivHouseholderQr().solve(target);
  const double left = (target - matrix * weights).squaredNorm() / static_cast<double>(count);
  const VectorXd at_rest =
      matrix.leftCols(3) * matrix.leftCols(3).colPivHouseholderQr().solve(target);
  const double by_motion = (target - at_rest).squaredNorm() / static_cast<double>(count) - left;
  const double dissipated =
      (weights[3] * matrix.col(3) + weights[5] * matrix.col(5)).dot(matrix.col(3));
  return EffortFit{std::clamp(1.0 - left / all, 0.0, 1.0),
                   by_motion > kLeastByMotion * all && dissipated < 0.0 && weights[4] < 0.0,
                   mean_square(weights[4] * matrix.col(4)) / all};
}

bool leads(const VectorXd& position, const VectorXd& other) {
  const Eigen::Index count = other.size() - 2;
  if (count < kFewestRows) return false;
  const VectorXd change = other.tail(count) - other.head(count);
  const VectorXd ahead = (position - other).segment(1, count);
  const auto line = line_through(change, ahead);
  return line && line->slope > 0.0;
}

bool computed_from(const VectorXd& column, const Eigen::MatrixXd& others) {
  Eigen::MatrixXd matrix(others.rows(), others.cols() + 1);
  matrix << others, VectorXd::Ones(others.rows());
  if (!matrix.allFinite() || !column.allFinite()) return false;
  const VectorXd left = column - matrix * matrix.colPivHouseholderQr().solve(column);
  return left.squaredNorm() <
         kRoundingShare * mean_square(column) * static_cast<double>(column.size());
}

}  // namespace ravencal::record
