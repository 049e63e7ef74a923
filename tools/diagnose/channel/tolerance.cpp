// SPDX-License-Identifier: Apache-2.0
//
// How well the recording fixes the parameters that the plant has.
#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/selection/invariance.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kResamples = 100;
constexpr double kNormal95 = 1.96;

}  // namespace

VectorXd nominal_deviation(const ChannelFit& fit, std::uint64_t seed) {
  const auto count = static_cast<Index>(fit.nominal.terms.size());
  const MatrixXd columns = fit.model.columns();
  const Moments moments = moments_of(fit.model.blocks, columns, fit.model.target);
  const VectorXd precision = fit.model.column_precision(columns.cols());
  std::mt19937_64 engine(seed);
  VectorXd square = VectorXd::Zero(count);
  for (int r = 0; r < kResamples; ++r) {
    MatrixXd sum = MatrixXd::Zero(columns.cols() + 1, columns.cols() + 1);
    for (std::size_t n = 0; n < moments.block.size(); ++n)
      sum += moments.block[engine() % moments.block.size()];
    const VectorXd drawn = solve(sum, precision, 1e-6);
    square += (drawn - fit.coefficients).segment(1, count).array().square().matrix();
  }
  return (square / kResamples).cwiseSqrt();
}

std::optional<Interval> friction_behind(const ChannelFit& fit, const ChannelOptions& options) {
  const auto& terms = fit.nominal.terms;
  const auto level = std::find_if(terms.begin(), terms.end(), [](const NominalTerm& t) {
    return t.id == "joint_friction" && t.parameter == "level" && !t.form_only;
  });
  if (fit.model.series->stage != Stage::kTransmission || level == terms.end()) return std::nullopt;
  const auto term = static_cast<std::size_t>(level - terms.begin());
  const auto column = static_cast<Index>(term) + 1;
  ChannelFit free = fit;
  ChannelModel& model = free.model;
  model.base.col(column) = model.free_base.col(column);
  model.target += model.held[term] * model.free_base.col(column);
  model.held[term] = 0.0;
  model.precision[column] = 0.0;
  free.coefficients = joint_fit(model);
  const auto [low, high] = interval_over_time(free, column, options.seed + 570, Doubt::kFormToo);
  const double form = kNormal95 * kModelForm;
  const double change = free.coefficients[column];
  return Interval{level->value * (1.0 + change - std::hypot(change - low, form)),
                  level->value * (1.0 + change + std::hypot(high - change, form))};
}

}  // namespace ravencal::diagnose
