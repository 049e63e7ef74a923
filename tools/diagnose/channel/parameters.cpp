// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/fit/standard_normal.hpp"
#include "diagnose/selection/invariance.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kResamples = 400;
constexpr double kNormal95 = 1.96;

/// Moments of the blocks drawn with replacement.
MatrixXd resampled(const Moments& moments, std::mt19937_64& engine) {
  MatrixXd sum = MatrixXd::Zero(moments.block.front().rows(), moments.block.front().cols());
  for (std::size_t n = 0; n < moments.block.size(); ++n) {
    sum += moments.block[engine() % moments.block.size()];
  }
  return sum;
}

/// The chosen effect's columns, moved along its shape to first order where that is free.
struct Tangent {
  MatrixXd columns;  ///< of the whole model, the shape's own last
  bool with_shape = false;
  Index at = 0;  ///< of the effect's first coefficient
  Index width = 0;
};

Tangent tangent_of(const ChannelFit& fit, std::size_t chosen) {
  const ChannelModel& model = fit.model;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  Tangent t{model.columns(), false, model.first_column(chosen), own.columns.cols()};
  t.with_shape = form.continuous() && !own.shape.empty() && !form.unit_coefficient(*model.series);
  if (!t.with_shape) return t;
  constexpr double kStep = 0.02;
  const MatrixXd moved =
      model.blocks.gather(seen_columns(form, *model.series, {own.shape[0] * (1.0 + kStep)}));
  // A part of a joint replay moves with its shape as the effect alone would.
  const MatrixXd alone = own.everywhere.size() > 0
                             ? model.blocks.gather(seen_columns(form, *model.series, own.shape))
                             : own.columns;
  t.columns.conservativeResize(Eigen::NoChange, t.columns.cols() + 1);
  t.columns.rightCols(1) =
      (moved - alone).leftCols(t.width) * fit.coefficients.segment(t.at, t.width) / kStep;
  return t;
}

/// One bootstrap draw of the coefficients: blocks with replacement, and each nominal number from
/// its own tolerance, which the fit takes for known.
VectorXd drawn_coefficients(const ChannelFit& fit, const Moments& moments,
                            const VectorXd& precision, std::mt19937_64& engine) {
  MatrixXd sum = resampled(moments, engine);
  const Index last = sum.cols() - 1;
  for (std::size_t t = 0; t < fit.nominal.terms.size(); ++t) {
    const double centre = fit.model.tolerance[t] * standard_normal(engine);
    const Index column = static_cast<Index>(t) + 1;
    sum(column, last) += precision[column] * centre;
    sum(last, column) = sum(column, last);
  }
  return solve(sum, precision, 1e-6);
}

/// Factor of a bootstrap's deviations: with few blocks it knows less of the spread between them
/// than it says (Efron 1982, Student's quantile after Cornish and Fisher).
double few_blocks(std::size_t blocks, Index free) {
  const double degrees = std::max(3.0, static_cast<double>(blocks) - static_cast<double>(free));
  const double z2 = kNormal95 * kNormal95;
  return std::sqrt((degrees + 1.0) / degrees) * (1.0 + (z2 + 1.0) / (4.0 * degrees));
}

/// Central 95 % of the draws about the value, each side wider by that factor. Draws know no limits
/// of the plant's numbers and may scatter about another centre: the scatter counts to both sides,
/// and the way to that centre on its own.
std::pair<double, double> interval_of(std::vector<double>& draws, double value, double wider) {
  std::sort(draws.begin(), draws.end());
  const double low = draws[static_cast<std::size_t>(0.025 * kResamples)];
  const double middle = draws[kResamples / 2];
  const double high = draws[static_cast<std::size_t>(0.975 * kResamples) - 1];
  return {value - wider * std::max(middle - low, value - low),
          value + wider * std::max(high - middle, high - value)};
}

/// The same of a number that is positive by nature: in its logarithm.
std::pair<double, double> positive_interval_of(std::vector<double>& draws, double value,
                                               double wider) {
  for (double& draw : draws) draw = std::log(draw);
  const auto [low, high] = interval_of(draws, std::log(value), wider);
  return {std::exp(low), std::exp(high)};
}

/// Deviation of an effect's coefficient that a number of the plant with the same column leaves: the
/// effect was given its whole change.
double taken_deviation(const ChannelModel& model, const Chosen& own) {
  if (own.columns.cols() != 1) return 0.0;
  double squares = 0.0;
  for (std::size_t t = 0; t < model.tolerance.size(); ++t) {
    const VectorXd column = model.free_base.col(static_cast<Index>(t) + 1);
    if (!same_column(column, own.columns.col(0))) continue;
    const double ratio = column.norm() / own.columns.norm();
    squares += std::pow(model.tolerance[t] * ratio, 2);
  }
  return std::sqrt(squares);
}

}  // namespace

std::vector<NamedParameter> parameters_of(const ChannelFit& fit, std::size_t chosen,
                                          std::uint64_t seed) {
  const ChannelModel& model = fit.model;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  const Tangent tangent = tangent_of(fit, chosen);
  const Moments moments = moments_of(model.blocks, tangent.columns, model.target);
  const VectorXd precision = model.column_precision(tangent.columns.cols());
  const auto central = form.parameters(*model.series, own.shape,
                                       fit.coefficients.segment(tangent.at, tangent.width));
  std::vector<std::vector<double>> draws(central.size());
  std::mt19937_64 engine(seed);
  const double taken = form.nominal_term() ? 0.0 : taken_deviation(model, own);
  for (int r = 0; r < kResamples; ++r) {
    VectorXd drawn = drawn_coefficients(fit, moments, precision, engine);
    if (taken > 0.0) drawn[tangent.at] += taken * standard_normal(engine);
    Shape shape = own.shape;
    if (tangent.with_shape) shape[0] *= std::exp(std::clamp(drawn[drawn.size() - 1], -0.7, 0.7));
    const auto values =
        form.parameters(*model.series, shape, drawn.segment(tangent.at, tangent.width));
    for (std::size_t p = 0; p < values.size() && p < draws.size(); ++p)
      draws[p].push_back(values[p].value);
  }
  const double wider =
      few_blocks(model.blocks.count(), tangent.width + (tangent.with_shape ? 1 : 0));
  std::vector<NamedParameter> out;
  for (std::size_t p = 0; p < central.size(); ++p) {
    const double value = central[p].value;
    // The first is a size, which may be none; what is positive in every draw beside it is a shape.
    const bool shape =
        p > 0 && value > 0.0 && *std::min_element(draws[p].begin(), draws[p].end()) > 0.0;
    out.push_back({central[p].name, value, central[p].unit,
                   shape ? positive_interval_of(draws[p], value, wider)
                         : interval_of(draws[p], value, wider)});
  }
  return out;
}

std::pair<double, double> offset_interval(const ChannelFit& fit, std::uint64_t seed) {
  const ChannelModel& model = fit.model;
  const MatrixXd columns = model.columns();
  const Moments moments = moments_of(model.blocks, columns, model.target);
  const VectorXd precision = model.column_precision(columns.cols());
  std::vector<double> draws;
  std::mt19937_64 engine(seed);
  for (int r = 0; r < kResamples; ++r)
    draws.push_back(drawn_coefficients(fit, moments, precision, engine)[0]);
  return interval_of(draws, fit.coefficients[0], few_blocks(model.blocks.count(), 1));
}

void widen_by_form(const Invariance& invariance, bool of_cable,
                   std::vector<NamedParameter>& parameters) {
  if (parameters.empty()) return;
  const double relative =
      kNormal95 * std::hypot(invariance.deviation(), of_cable ? kModelForm : 0.0);
  NamedParameter& size = parameters.front();
  const double more = relative * std::abs(size.value);
  size.ci95 = {size.value - std::hypot(size.value - size.ci95.first, more),
               size.value + std::hypot(size.ci95.second - size.value, more)};
}

void add_held_out(const ChannelFit& fit, ChannelFindings& findings) {
  const Series& series = *fit.model.series;
  double before = 0.0, after = 0.0, signal = 0.0, count = 0.0;
  if (series.any_held_out()) {
    for (Index i = 0; i < series.rows(); ++i) {
      const auto n = static_cast<std::size_t>(i);
      if (series.held_out[n] == 0 || series.valid[n] == 0) continue;
      before += std::pow(series.y[i] - fit.nominal.prediction[i], 2);
      after += std::pow(series.y[i] - fit.prediction[i], 2);
      signal += series.y[i] * series.y[i];
      count += 1.0;
    }
  } else {
    before = fit.model.blocks.gather(series.y - fit.nominal.prediction).squaredNorm();
    after = fit.held_out_residual.squaredNorm();
    signal = fit.model.blocks.gather(series.y).squaredNorm();
    count = static_cast<double>(fit.model.target.size());
  }
  if (count == 0.0) return;
  const auto rms = [count](double sum) { return std::sqrt(sum / count); };
  const std::string what = series.stage == Stage::kDrive      ? "effort_rmse"
                           : series.stage == Stage::kTracking ? "tracking_rmse"
                                                              : "position_rmse";
  // The same against the effort as recorded, noise above the motion's band included.
  double recorded_before = 0.0, recorded_after = 0.0, recorded_signal = 0.0;
  const Index recorded_rows = series.any_held_out() ? series.recorded.size() : 0;
  for (Index i = 0; i < recorded_rows; ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (series.held_out[n] == 0 || series.valid[n] == 0) continue;
    recorded_before += std::pow(series.recorded[i] - fit.nominal.prediction[i], 2);
    recorded_after += std::pow(series.recorded[i] - fit.prediction[i], 2);
    recorded_signal += series.recorded[i] * series.recorded[i];
  }
  findings.held_out.push_back(
      {findings.joint, what, findings.unit, rms(before), rms(after), findings.floor});
  if (series.stage == Stage::kDrive && signal > 0.0) {
    const double scale = 100.0 / std::sqrt(signal / count);
    findings.held_out.push_back({findings.joint, "effort_relative_error", "%", rms(before) * scale,
                                 rms(after) * scale, findings.floor * scale});
    if (recorded_signal > 0.0) {
      const auto percent = [&](double sum) { return 100.0 * std::sqrt(sum / recorded_signal); };
      findings.held_out.push_back({findings.joint, "effort_relative_error_unfiltered", "%",
                                   percent(recorded_before), percent(recorded_after),
                                   findings.floor * scale});
    }
  }
}

}  // namespace ravencal::diagnose
