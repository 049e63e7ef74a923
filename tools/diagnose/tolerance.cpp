// SPDX-License-Identifier: Apache-2.0
//
// Parameters that the plant has, refitted: beyond its tolerance a number is wrong, which is a
// verdict of its own and no missing physics.
#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kResamples = 100;

/// Held-out error per block with the term's change held at `change`, everything else refitted.
VectorXd errors_at(const ChannelModel& model, Index column, double change) {
  ChannelModel held = model;
  held.target -= change * model.base.col(column);
  held.base.col(column).setZero();
  const MatrixXd columns = held.columns();
  return held_out_error(held.blocks, moments_of(held.blocks, columns, held.target),
                        held.column_precision(columns.cols()));
}

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

void name_tolerances(const ChannelFit& fit, const ChannelOptions& options,
                     ChannelFindings& findings) {
  const ChannelModel& model = fit.model;
  const VectorXd deviation = nominal_deviation(fit, options.seed + 550);
  for (std::size_t i = 0; i < fit.nominal.terms.size(); ++i) {
    const NominalTerm& term = fit.nominal.terms[i];
    const Index column = static_cast<Index>(i) + 1;
    const double change = fit.coefficients[column];
    const double error = 1.96 * deviation[static_cast<Index>(i)];
    if (std::abs(change) - error <= term.tolerance) continue;
    const VectorXd before = errors_at(model, column, std::copysign(term.tolerance, change));
    const VectorXd after = errors_at(model, column, change);
    const VectorXd gain = before - after;
    VectorXd beyond = (std::abs(change) - term.tolerance) * model.base.col(column);
    beyond.array() -= beyond.mean();
    const double size = std::sqrt(beyond.squaredNorm() / static_cast<double>(beyond.size()));
    const double p = sign_flip_p(gain, options.seed + 560 + i);
    if (gain.sum() < options.gates.least_share * before.sum() ||
        p > std::max(options.gates.alpha, 1.5e-3) ||
        size < options.gates.size_per_floor * model.floor) {
      continue;
    }
    NamedEffect effect;
    effect.id = term.id;
    effect.joint = findings.joint;
    effect.stage = stage_word(findings.stage);
    const double half = error * std::abs(term.value);
    const double value = term.value * (1.0 + change);
    effect.parameters = {{term.parameter, value, term.unit, {value - half, value + half}}};
    effect.held_out_before = model.rms_of(before);
    effect.held_out_after = model.rms_of(after);
    effect.unit = findings.unit;
    effect.p_value = p;
    effect.size = size;
    effect.out_of_tolerance = true;
    effect.separate_by = "check the plant's number against its source";
    findings.effects.push_back(std::move(effect));
  }
}

}  // namespace ravencal::diagnose
