// SPDX-License-Identifier: Apache-2.0
#include "diagnose/contenders.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool admissible(const Evidence& e, const ChannelModel& model, const Gates& gates) {
  return repeats(gates, e.z, e.block_p) && e.p_value <= gates.alpha &&
         e.share >= gates.least_share && e.size >= gates.size_per_floor * model.floor;
}

/// Cost of missing physics: one candidate out of some twenty (2 ln 20).
constexpr double kPhysicsCost = 6.0;
/// Per free coefficient and shape (Akaike).
constexpr double kFreedomCost = 2.0;

/// A number beyond its tolerance: its owner was wrong about it, not unlucky, and errors of that
/// kind have long tails (Cauchy, tolerances as unit).
double out_of_tolerance_cost(double change) { return 2.0 * std::log1p(change * change); }

double prior_cost(const ChannelModel& model) {
  const VectorXd b = joint_fit(model);
  double cost = 0.0;
  for (std::size_t term = 0; term < model.tolerance.size(); ++term) {
    const double change = b[static_cast<Index>(term) + 1] / model.tolerance[term];
    cost += change * change;
  }
  const Chosen& last = model.chosen.back();
  if (const auto term = model.candidates[last.candidate]->form->nominal_term()) {
    const double change = b[b.size() - 1] / model.tolerance[*term];
    return cost + out_of_tolerance_cost(change) + kFreedomCost;
  }
  return cost + kPhysicsCost +
         kFreedomCost *
             static_cast<double>(last.columns.cols() + static_cast<Index>(last.shape.size()));
}

}  // namespace

VectorXd errors_of(const ChannelModel& model) {
  const MatrixXd columns = model.columns();
  return held_out_error(model.blocks, moments_of(model.blocks, columns, model.target),
                        model.column_precision(columns.cols()));
}

Evidence anew(Evidence e, const VectorXd& before, const VectorXd& after, double rows,
              std::uint64_t seed) {
  const VectorXd gains = before - after;
  const double gain = gains.sum();
  e.held_out_before = std::sqrt(before.sum() / rows);
  e.held_out_after = std::sqrt(after.sum() / rows);
  e.z = z_score(gains);
  e.block_p = sign_flip_p(gains, seed, 999);
  e.share = gain / std::max(before.sum(), 1e-300);
  e.size = std::sqrt(std::max(0.0, gain) / rows);
  return e;
}

bool last_is_consistent(const ChannelModel& model) {
  const Chosen& last = model.chosen.back();
  const EffectForm& form = *model.candidates[last.candidate]->form;
  const VectorXd b = joint_fit(model).tail(last.columns.cols());
  if (const auto term = form.nominal_term(); term && std::abs(b[0]) <= model.limit[*term])
    return false;
  return form.inconsistency(*model.series, last.shape, b).empty();
}

std::vector<Contender> contenders(const ChannelModel& model, const ScreenResult& result,
                                  const Gates& gates) {
  const double variance = model.noise.squaredNorm() / static_cast<double>(model.noise.size());
  const double unit = std::max(variance * model.correlation_rows, 1e-300);
  std::vector<Contender> out;
  const auto rows = static_cast<double>(std::max<Index>(1, model.target.size()));
  for (const TestedCandidate& tested : result.tested) {
    if (tested.evidence.p_value > gates.alpha) continue;
    ChannelModel with = model;
    with.chosen.push_back(tested.best);
    with.hold_nominal();
    Contender contender{&tested, errors_of(with), 0.0};
    const Evidence e = anew(tested.evidence, result.errors, contender.errors, rows, 1);
    if (!admissible(e, model, gates) || !last_is_consistent(with)) continue;
    contender.score = contender.errors.sum() / unit + prior_cost(with);
    out.push_back(std::move(contender));
  }
  return out;
}

}  // namespace ravencal::diagnose
