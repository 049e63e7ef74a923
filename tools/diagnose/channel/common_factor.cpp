// SPDX-License-Identifier: Apache-2.0
//
// Numbers of a drive that are all off by one factor: each may lie within its tolerance, so that no
// error is left to be seen, but that they agree is a coincidence which a wrong torque constant
// explains.
#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The model with numbers that are spread evenly within their tolerances, which as deviations are
/// smaller by a root.
ChannelModel with_even_numbers(ChannelModel model, const std::vector<NominalTerm>& terms) {
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms[t].form_only) continue;
    model.precision[static_cast<Index>(t) + 1] /= kVarianceWithin;
    model.tolerance[t] *= std::sqrt(kVarianceWithin);
  }
  model.hold_nominal();
  return model;
}

}  // namespace

void adopt_common_factor(ChannelFit& fit) {
  if (fit.model.series->stage != Stage::kDrive || !fit.model.chosen.empty()) return;
  const auto& candidates = fit.model.candidates;
  const auto found = std::find_if(candidates.begin(), candidates.end(), [](const auto& c) {
    return c->untestable.empty() && c->form->off_by(VectorXd::Zero(1)).has_value();
  });
  if (found == candidates.end()) return;
  const ChannelModel without = with_even_numbers(fit.model, fit.nominal->terms);
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
  if (score_of(without) - score_of(with) - cost < kNoCoincidence) return;
  with.tolerance = fit.model.tolerance;
  fit.model = std::move(with);
}

}  // namespace ravencal::diagnose
