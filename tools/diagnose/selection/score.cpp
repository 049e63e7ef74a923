// SPDX-License-Identifier: Apache-2.0
//
// The penalised score of a model: held-out error in units of its noise, and what is thought of its
// effects and numbers beforehand.
#include <algorithm>
#include <cmath>

#include "diagnose/findings/policy.hpp"
#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

double noise_unit(const ChannelModel& model) {
  const double variance = model.noise.squaredNorm() / static_cast<double>(model.noise.size());
  return std::max(variance * model.correlation_rows, 1e-300);
}

VectorXd held_out_errors(const ChannelModel& model) {
  const MatrixXd columns = model.columns();
  return held_out_error(model.blocks, moments_of(model.blocks, columns, model.target),
                        model.column_precision(columns.cols()));
}

double effect_cost(Index numbers) {
  return kCandidateCost + kFreedomCost * static_cast<double>(numbers);
}

double missing_cost(const EffectForm& form, const Series& series) {
  return form.ordinary(series) ? 0.0 : kMissingCost;
}

// A size that a replay takes as its shape has no coefficient of its own.
Index freedom_of(const ChannelModel& model, const Chosen& chosen) {
  const EffectForm& form = *model.candidates[chosen.candidate]->form;
  const Index numbers = chosen.columns.cols() + static_cast<Index>(chosen.shape.size());
  return form.unit_coefficient(*model.series) ? numbers - 1 : numbers;
}

// A number beyond its tolerance: its owner was wrong about it, not unlucky, and errors of that kind
// have long tails (Cauchy, tolerances as unit).
double number_cost(double change, double tolerance) {
  const double relative = change / tolerance;
  return 2.0 * std::log1p(relative * relative) + kFreedomCost;
}

double cost_of(const ChannelModel& model, const Chosen& chosen, const VectorXd& coefficients) {
  const EffectForm& form = *model.candidates[chosen.candidate]->form;
  if (const auto term = form.nominal_term())
    return number_cost(coefficients[0], model.tolerance[*term]);
  const auto off = form.off_by(coefficients);
  if (off) return number_cost(*off, 1.0) + kMotorCost;
  return effect_cost(freedom_of(model, chosen)) + missing_cost(form, *model.series);
}

double chosen_cost(const ChannelModel& model, std::size_t effect, const VectorXd& coefficients) {
  const Chosen& chosen = model.chosen[effect];
  return cost_of(model, chosen,
                 coefficients.segment(model.first_column(effect), chosen.columns.cols()));
}

double nominal_cost(const ChannelModel& model, const VectorXd& coefficients) {
  double cost = 0.0;
  for (std::size_t term = 0; term < model.tolerance.size(); ++term) {
    const double change = coefficients[static_cast<Index>(term) + 1] / model.tolerance[term];
    cost += change * change;
  }
  return cost;
}

Compared as_compared(const ChannelModel& model) {
  return {model.chosen_candidates(), !model.steps.empty(), held_out_errors(model),
          prior_cost(model, joint_fit(model)), 0.0};
}

ChannelModel without_constant(const ChannelModel& model) {
  ChannelModel out = model;
  out.free_base.col(0).setZero();
  out.precision[0] = 1.0;
  out.hold_nominal();
  return out;
}

double score_of(const ChannelModel& model) {
  return held_out_errors(model).sum() / noise_unit(model) + nominal_cost(model, joint_fit(model));
}

double prior_cost(const ChannelModel& model, const VectorXd& coefficients) {
  double cost = nominal_cost(model, coefficients);
  for (std::size_t i = 0; i < model.chosen.size(); ++i) cost += chosen_cost(model, i, coefficients);
  // In the transmission homing brings one; a drive has one where physics is missing.
  if (model.has_constant())
    cost += effect_cost(1) + (model.series->stage == Stage::kDrive ? kMissingCost : 0.0);
  // Of a step also the time is free.
  return cost + static_cast<double>(model.steps.size()) * effect_cost(2);
}

double penalised_score(const ChannelModel& model, double unit) {
  return held_out_errors(model).sum() / unit + prior_cost(model, joint_fit(model));
}

double penalised_score(const ChannelModel& model) {
  return penalised_score(model, noise_unit(model));
}

bool tied(const VectorXd& a, const VectorXd& b) {
  const VectorXd difference = a - b;
  const auto count = static_cast<double>(difference.size());
  const double mean = difference.mean();
  const double deviation =
      std::sqrt((difference.array() - mean).square().sum() / std::max(1.0, count - 1.0));
  return std::abs(mean) < 2.0 * deviation / std::sqrt(count);
}

}  // namespace ravencal::diagnose
