// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kResamples = 200;

/// Moments of the blocks drawn with replacement.
MatrixXd resampled(const Moments& moments, std::mt19937_64& engine) {
  MatrixXd sum = MatrixXd::Zero(moments.block.front().rows(), moments.block.front().cols());
  for (std::size_t n = 0; n < moments.block.size(); ++n) {
    sum += moments.block[engine() % moments.block.size()];
  }
  return sum;
}

}  // namespace

std::vector<NamedParameter> parameters_of(const ChannelFit& fit, std::size_t chosen,
                                          std::uint64_t seed) {
  const ChannelModel& model = fit.model;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  Index at = model.base.cols();
  for (std::size_t i = 0; i < chosen; ++i) at += model.chosen[i].columns.cols();
  const Index width = own.columns.cols();
  const VectorXd b = fit.coefficients.segment(at, width);

  MatrixXd columns = model.columns();
  const bool with_shape =
      form.continuous() && !own.shape.empty() && !form.unit_coefficient(*model.series);
  constexpr double kStep = 0.02;
  if (with_shape) {
    const MatrixXd moved =
        model.blocks.gather(seen_columns(form, *model.series, {own.shape[0] * (1.0 + kStep)}));
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols(1) = (moved - own.columns) * b / kStep;
  }
  const Moments moments = moments_of(model.blocks, columns, model.target);
  const VectorXd precision = model.column_precision(columns.cols());

  const auto central = form.parameters(*model.series, own.shape, b);
  std::vector<std::vector<double>> draws(central.size());
  std::mt19937_64 engine(seed);
  for (int r = 0; r < kResamples; ++r) {
    const VectorXd drawn = solve(resampled(moments, engine), precision, 1e-6);
    Shape shape = own.shape;
    if (with_shape) shape[0] *= std::exp(std::clamp(drawn[drawn.size() - 1], -0.7, 0.7));
    const auto values = form.parameters(*model.series, shape, drawn.segment(at, width));
    for (std::size_t p = 0; p < values.size() && p < draws.size(); ++p)
      draws[p].push_back(values[p].value);
  }
  std::vector<NamedParameter> out;
  for (std::size_t p = 0; p < central.size(); ++p) {
    std::sort(draws[p].begin(), draws[p].end());
    const double low = draws[p][static_cast<std::size_t>(0.025 * kResamples)];
    const double high = draws[p][static_cast<std::size_t>(0.975 * kResamples) - 1];
    out.push_back({central[p].name,
                   central[p].value,
                   central[p].unit,
                   {std::min(low, central[p].value), std::max(high, central[p].value)}});
  }
  return out;
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
    before = fit.model.target.squaredNorm();
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
