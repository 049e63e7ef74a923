// SPDX-License-Identifier: Apache-2.0
//
// Numbers of a drive that are all off by one factor: each may lie within its tolerance, so that no
// error is left to be seen, but that they agree is a coincidence which a wrong torque constant
// explains.
#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Variance of a number that lies anywhere within its tolerance, in squared tolerances.
constexpr double kVarianceWithin = 1.0 / 3.0;
/// Twice the log of the odds (150 : 1) from which on agreement is no coincidence; nothing else
/// called for a name.
constexpr double kNoCoincidence = 10.0;

/// Tolerances beyond which the plant's numbers cannot stand in for the factor: it then shows in the
/// error like any other effect.
constexpr double kMostImitated = 1.5;

/// Weight of a term's squared change, in tolerances.
double weight_of(const NominalTerm& term) { return term.form_only ? 1.0 : 1.0 / kVarianceWithin; }

/// Error in units of its noise, and what the plant's numbers cost.
double score_of(const ChannelModel& model, const std::vector<NominalTerm>& terms) {
  const VectorXd b = joint_fit(model);
  double score = held_out_errors(model).sum() / noise_unit(model);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const double change = b[static_cast<Index>(t) + 1] / model.tolerance[t];
    score += weight_of(terms[t]) * change * change;
  }
  return score;
}

}  // namespace

void adopt_common_factor(ChannelFit& fit) {
  if (fit.model.series->stage != Stage::kDrive || !fit.model.chosen.empty()) return;
  const auto& candidates = fit.model.candidates;
  const auto found = std::find_if(candidates.begin(), candidates.end(), [](const auto& c) {
    return c->untestable.empty() && c->form->off_by(VectorXd::Zero(1)).has_value();
  });
  if (found == candidates.end()) return;
  ChannelModel without = fit.model;
  for (std::size_t t = 0; t < fit.nominal.terms.size(); ++t)
    without.precision[static_cast<Index>(t) + 1] *= weight_of(fit.nominal.terms[t]);
  without.hold_nominal();
  Chosen factor{
      static_cast<std::size_t>(found - candidates.begin()), {}, (*found)->columns.front()};
  factor.by_numbers = true;
  ChannelModel with = without.with(factor);
  const EffectForm& form = *(*found)->form;
  const VectorXd b = joint_fit(with).tail(1);
  if (!form.inconsistency(*with.series, {}, b).empty()) return;
  const double off = *form.off_by(b);
  if (std::abs(off) > kMostImitated) return;
  const double cost = number_cost(off, 1.0);
  if (score_of(without, fit.nominal.terms) - score_of(with, fit.nominal.terms) - cost <
      kNoCoincidence)
    return;
  fit.model = std::move(with);
}

}  // namespace ravencal::diagnose
