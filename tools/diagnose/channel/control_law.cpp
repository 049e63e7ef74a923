// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/control_law.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/median.hpp"
#include "diagnose/channel/channel.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Deviations from which on a difference counts for nothing (Tukey's biweight): normal noise loses
/// a sixth of what it says, an edge of a disturbance all of it.
constexpr double kTukey = 6.0;

/// Commands at exactly their greatest magnitude that make it a limit.
constexpr int kAtLimit = 5;

/// Fewer differences leave nothing to weigh.
constexpr Index kLeastDifferences = 10;

/// What a law leaves of the differences' RMS at least: less is rounding, which has no deviation.
constexpr double kExact = 1e-6;

/// What the law from neighbours leaves of longer differences over what their own law leaves, from
/// which on quantisation has bent it.
constexpr double kBent = 0.8;

/// A law that explains less of its differences is bent by its inputs, if that of longer ones
/// explains more.
constexpr double kWellExplained = 0.95;

/// Longer differences, and the most rows that one may span.
constexpr std::array kLonger_s = {0.1, 0.5};
constexpr Index kMostLag = 1000;

/// Rows in so long a time, at least one.
Index rows_in(double span_s, const Series& s) {
  const double usual_s = s.row_period_s();
  return usual_s > 0.0 ? std::clamp<Index>(std::lround(span_s / usual_s), 1, kMostLag) : 1;
}

/// Rows of [first, last) that end `lag` usable rows in one go.
std::vector<Index> ends_of_differences(const Series& s, Index first, Index last, Index lag) {
  const std::vector<char> usable = rows_of_law(s);
  std::vector<Index> rows;
  Index stretch = 0;
  for (Index i = first; i < last; ++i) {
    const auto n = static_cast<std::size_t>(i);
    stretch = usable[n] != 0 ? (s.fresh[n] != 0 ? 1 : stretch + 1) : 0;
    if (stretch > lag) rows.push_back(i);
  }
  return rows;
}

/// Weighted least squares on differences over `lag` rows of [first, last).
ControlLaw fit_differences(const Series& s, Index first, Index last, Index lag) {
  MatrixXd x(s.rows(), 3);
  x << s.position_error, s.measured_rate, s.desired_rate;
  const std::vector<Index> rows = ends_of_differences(s, first, last, lag);
  const auto count = static_cast<Index>(rows.size());
  MatrixXd dx(count, 3);
  VectorXd dy(count);
  for (Index r = 0; r < count; ++r) {
    const Index i = rows[static_cast<std::size_t>(r)];
    dx.row(r) = x.row(i) - x.row(i - lag);
    dy[r] = s.y[i] - s.y[i - lag];
  }
  const VectorXd column_scale = (dx.colwise().norm().array() + 1e-300).matrix().transpose();
  const MatrixXd z = dx * column_scale.cwiseInverse().asDiagonal();
  VectorXd weight = VectorXd::Ones(count);
  VectorXd gains = VectorXd::Zero(3);
  VectorXd left = dy;
  const double exact = kExact * dy.norm() / std::sqrt(std::max(1.0, static_cast<double>(count)));
  VectorXd u2 = VectorXd::Zero(count);  // squared, in units of what counts for nothing
  for (int round = 0; round < 8 && count > kLeastDifferences; ++round) {
    MatrixXd normal = z.transpose() * weight.asDiagonal() * z;
    normal.diagonal().array() += 1e-9;
    gains = normal.ldlt().solve(z.transpose() * weight.asDiagonal() * dy);
    left = dy - z * gains;
    const double scale = std::max(core::normal_deviation(left), exact);
    u2 = (left / (kTukey * scale)).array().square().min(1.0);
    weight = (1.0 - u2.array()).square();
  }
  ControlLaw law;
  law.lag = lag;
  law.gains = gains.cwiseQuotient(column_scale);
  law.residual = s.y - x * law.gains;
  const double whole = weight.dot(dy.cwiseAbs2());
  if (whole > 0.0) law.explained = std::max(0.0, 1.0 - weight.dot(left.cwiseAbs2()) / whole);
  // What the rates say of the error's differences is no evidence for the error's gain.
  const MatrixXd rates = z.rightCols(2);
  MatrixXd normal = rates.transpose() * weight.asDiagonal() * rates;
  normal.diagonal().array() += 1e-9;
  const VectorXd own =
      dx.col(0) - rates * normal.ldlt().solve(rates.transpose() * weight.cwiseProduct(dx.col(0)));
  law.pull = weight.cwiseProduct(own).cwiseProduct(left);
  // The pull's derivative: an outlier pulls less the farther off it is.
  law.worth = (1.0 - u2.array()) * (1.0 - 5.0 * u2.array()) * own.array().square();
  return law;
}

/// What a law leaves of the command's changes over `lag` rows.
double left_over(const ControlLaw& law, Index first, Index last, Index lag) {
  const Index count = last - first - lag;
  if (count <= 0) return 0.0;
  const VectorXd left =
      law.residual.segment(first + lag, count) - law.residual.segment(first, count);
  return core::normal_deviation(left);
}

/// True if quantisation has bent the law from shorter differences.
bool bent(const ControlLaw& law, const ControlLaw& longer, Index first, Index last) {
  const Index lag = longer.lag;
  return left_over(longer, first, last, lag) < kBent * left_over(law, first, last, lag);
}

}  // namespace

std::string unexplained(double share) {
  return fmt::format(
      "a law of position error and rates explains {:.0f} % of the recorded command, and {:.0f} % "
      "are needed: another law made it, or from inputs that the recording does not hold",
      100.0 * share, 100.0 * kLeastExplained);
}

std::vector<char> rows_of_law(const Series& s) {
  const double limit = s.y.cwiseAbs().maxCoeff() * (1.0 - 1e-9);
  const auto at_limit = (s.y.array().abs() >= limit).count();
  std::vector<char> usable(s.valid);
  for (Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    const bool cut = at_limit >= kAtLimit && std::abs(s.y[i]) >= limit;
    if (cut || s.held_out[n] != 0) usable[n] = 0;
  }
  return usable;
}

ControlLaw fit_law(const Series& s, Index first, Index last, Disturbance beside) {
  const bool pulsed = beside == Disturbance::kPulses;
  ControlLaw law = fit_differences(s, first, last, 1);
  for (const double span_s : kLonger_s) {
    const Index lag = rows_in(span_s, s);
    if (lag <= law.lag || (pulsed && span_s > kLonger_s.front())) continue;
    ControlLaw longer = fit_differences(s, first, last, lag);
    const bool more = law.explained < kWellExplained && longer.explained > law.explained;
    if ((more && !pulsed) || bent(law, longer, first, last)) law = std::move(longer);
  }
  return law;
}

double resolution_of(const Series& s) {
  const double least = 1e-9 * s.y.cwiseAbs().maxCoeff();
  double step = std::numeric_limits<double>::infinity();
  for (Index i = 1; i < s.rows(); ++i) {
    const double change = std::abs(s.y[i] - s.y[i - 1]);
    if (change > least) step = std::min(step, change);
  }
  return std::isfinite(step) ? step : 0.0;
}

Eigen::Vector3d recorded_gains(const Series& series, Index first, Index last) {
  return fit_law(series, first, last, Disturbance::kPulses).gains;
}

}  // namespace ravencal::diagnose
