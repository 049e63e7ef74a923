// SPDX-License-Identifier: Apache-2.0
//
// What a channel's fit found, in the vocabulary's names.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/cable_members.hpp"
#include "diagnose/selection/invariance.hpp"
#include "diagnose/selection/posterior.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

}  // namespace

std::string reported_stage(std::string_view id, Stage shown_in) {
  if (shown_in != Stage::kTransmission) return std::string(stage_word(shown_in));
  const std::string_view enters_at = traits_of(id).enters_at;
  return std::string(enters_at.empty() ? stage_word(shown_in) : enters_at);
}

std::vector<NamedParameter> sizes_of(const ChannelFit& fit, std::size_t chosen,
                                     const Invariance& invariance, const ChannelOptions& options) {
  const EffectForm& form = *fit.model.candidates[fit.model.chosen[chosen].candidate]->form;
  auto parameters =
      parameters_of(fit, chosen, derived_seed(options.seed, "sizes", chosen), Doubt::kFormToo);
  widen_by_form(invariance, cable_kind(form, *fit.model.series).has_value(), parameters);
  return parameters;
}

bool certain(const ChannelFit& fit, std::size_t chosen,
             const std::vector<NamedParameter>& parameters) {
  const EffectForm& form = *fit.model.candidates[fit.model.chosen[chosen].candidate]->form;
  const std::size_t sizes = std::min(parameters.size(), form.sizes(*fit.model.series));
  return parameters.empty() ||
         std::any_of(parameters.begin(), parameters.begin() + static_cast<std::ptrdiff_t>(sizes),
                     [](const NamedParameter& p) { return leaves_out_zero(p.ci95); });
}

void name_effects(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const EffectForm& form = *fit.model.candidates[fit.model.chosen[i].candidate]->form;
    const Evidence evidence =
        evidence_of(fit.model, i, options.gates, derived_seed(options.seed, "evidence", i));
    NamedEffect effect;
    effect.id = form.id();
    effect.from = form.from();
    effect.joint = findings.joint;
    effect.stage = reported_stage(effect.id, findings.stage);
    const Invariance invariance = invariance_of(fit.model, fit.coefficients, i);
    effect.parameters = sizes_of(fit, i, invariance, options);
    effect.held_out_before = evidence.held_out_before;
    effect.held_out_after = evidence.held_out_after;
    effect.unit = findings.unit;
    effect.p_value = evidence.p_value;
    effect.size = evidence.size;
    effect.invariance_spread = invariance.spread;
    const EffectPosterior posterior = posterior_of(fit.model, fit.coefficients, i, options.gates,
                                                   derived_seed(options.seed, "posterior", i));
    effect.probability = posterior.probability;
    effect.ambiguous_with = posterior.credible_others(kCredible);
    if (posterior.in_place < kLeastInPlace) {
      findings.notes.push_back(fmt::format(
          "joint {} ({}): {} and {} others explain the same error as well, which is no "
          "name",
          findings.joint, stage_word(findings.stage), effect.id, effect.ambiguous_with.size()));
      findings.unexplained.push_back({findings.joint,
                                      std::string(stage_word(findings.stage)),
                                      std::clamp(evidence.share, 0.0, 1.0),
                                      evidence.size,
                                      findings.unit,
                                      {}});
      findings.kept.push_back(std::move(effect));
      continue;
    }
    effect.separate_by = form.separate_by();
    effect.out_of_tolerance = form.nominal_term().has_value();
    // What makes the others steady is part of the model, but no name below the gate of size; nor
    // is what may as well be nothing.
    effect.certain = effect.out_of_tolerance || certain(fit, i, effect.parameters);
    widen_by_held(fit, i, effect.parameters);
    const bool large = fit.model.chosen[i].by_numbers ||
                       evidence.size >= options.gates.size_per_floor * fit.model.floor;
    ((large && effect.certain) || effect.out_of_tolerance ? findings.effects : findings.kept)
        .push_back(std::move(effect));
  }
}

void name_refitted(const ChannelFit& fit, ChannelFindings& findings) {
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t) {
    const NominalTerm& term = fit.nominal->terms[t];
    const double change = fit.coefficients[static_cast<Index>(t) + 1];
    const Traits& traits = traits_of(term.id);
    const bool load = traits.weight != Weight::kNone || traits.friction == Friction::kBehindCable;
    if (term.form_only || change == 0.0 || term.value == 0.0) continue;
    // What the drive feels as an effort it also knows best.
    if (load && fit.model.series->stage == Stage::kTransmission) continue;
    NamedEffect effect;
    effect.id = term.id;
    effect.from = term.from;
    effect.joint = findings.joint;
    effect.stage = stage_word(findings.stage);
    effect.out_of_tolerance = true;
    const double value = term.value * (1.0 + change);
    effect.parameters = {{term.parameter, value, term.unit, {value, value}}};
    findings.refitted.push_back(std::move(effect));
  }
  const Stage stage = fit.model.series->stage;
  if (stage != Stage::kTransmission && stage != Stage::kTracking) return;
  // A constant too small or too uncertain for a name still belongs to the prediction.
  NamedEffect offset;
  offset.id = homing_offset_kind().id();
  offset.joint = findings.joint;
  offset.stage = stage_word(findings.stage);
  const double value = fit.coefficients[0];
  offset.parameters = {{"offset", value, findings.unit, {value, value}}};
  findings.refitted.push_back(std::move(offset));
}

void add_candidates(const ChannelFit& fit, const ChannelOptions& options,
                    ChannelFindings& findings) {
  const ScreenResult result =
      screen(fit.model, options.gates, derived_seed(options.seed, "candidates"));
  for (const TestedCandidate& t : result.tested) {
    const EffectForm& form = *fit.model.candidates[t.candidate]->form;
    const Evidence& e = t.evidence;
    std::string outcome = "below its gates";
    if (!t.consistent)
      outcome = "numbers cannot be this effect";
    else if (e.p_value > options.gates.alpha)
      outcome = "chance does as well";
    else if (!repeats(options.gates, e.z, e.block_p))
      outcome = "gain not repeated in held-out blocks";
    else if (e.size < options.gates.size_per_floor * fit.model.floor)
      outcome = "smaller than half the floor";
    findings.candidates.push_back({findings.joint, std::string(stage_word(findings.stage)),
                                   form.key(), e.share, e.z, e.p_value, e.size, findings.unit,
                                   outcome});
  }
}

}  // namespace ravencal::diagnose
