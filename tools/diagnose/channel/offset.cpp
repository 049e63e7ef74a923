// SPDX-License-Identifier: Apache-2.0
//
// The constant of a channel. In the transmission: a homing offset, or the mean of what loads do to
// the cable. In the drive: friction that differs between the directions, or a weight.
#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/posterior.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Error that a simulation of the cable's stretch has at best, constant included.
double form_error(const ChannelFit& fit) {
  const VectorXd stretch = stretch_of(fit);
  return kModelForm * std::sqrt(stretch.squaredNorm() / static_cast<double>(stretch.size()));
}

/// Sizes below which a constant is the plant's own: what it draws at homing, the floor, what other
/// joints pass on, and what no simulation of the stretch has right.
double least_offset(const ChannelFit& fit, const physics::Plant& plant) {
  const Series& series = *fit.model.series;
  const auto joint = plant.joint_index(series.joint).value_or(0);
  double passed_on = 0.0;
  for (const Inherited& part : series.inherited) passed_on += std::abs(part.offset);
  return std::max({3.0 * plant.joints[joint].parameter(homing_offset_kind().id(), "deviation"),
                   fit.model.floor, 1.25 * passed_on, form_error(fit)});
}

/// What the constant takes off the held-out error, and what else could.
struct ConstantEvidence {
  VectorXd before, after;  ///< held-out squared errors per block
  double p_value = 1.0;
  EffectPosterior posterior;
};

std::optional<ConstantEvidence> constant_evidence(const ChannelFit& fit, const EffectForm& form,
                                                  const ChannelOptions& options) {
  const ChannelModel bare = without_constant(fit.model);
  ConstantEvidence e{held_out_errors(bare), held_out_errors(fit.model), 1.0, {}};
  const VectorXd gains = e.before - e.after;
  e.p_value = sign_flip_p(gains, derived_seed(options.seed, "constant"));
  if (fit.model.rms_of(gains.cwiseMax(0.0)) < form_error(fit)) return std::nullopt;
  if (!repeats(options.gates, z_score(gains), e.p_value) || e.p_value > options.gates.alpha ||
      gains.sum() < options.gates.least_share * e.before.sum() ||
      penalised_score(fit.model) > penalised_score(bare))
    return std::nullopt;
  e.posterior = posterior_of_constant(fit.model, form, options.gates,
                                      derived_seed(options.seed, "constant posterior"));
  return e;
}

/// `factor` times the constant.
NamedParameter constant_as(const char* name, double factor, const ChannelFit& fit,
                           const std::string& unit, std::uint64_t seed) {
  const auto [low, high] = interval_over_time(fit, 0, seed, Doubt::kFormToo);
  return {name, factor * fit.coefficients[0], unit, {factor * low, factor * high}};
}

/// The constant under the name of `form`.
NamedEffect effect_of(const ChannelFit& fit, const ConstantEvidence& evidence,
                      const EffectForm& form, NamedParameter constant,
                      const ChannelFindings& findings) {
  NamedEffect effect;
  effect.id = form.id();
  effect.joint = findings.joint;
  effect.stage = stage_word(findings.stage);
  effect.certain = leaves_out_zero(constant.ci95);
  effect.parameters = {std::move(constant)};
  effect.held_out_before = fit.model.rms_of(evidence.before);
  effect.held_out_after = fit.model.rms_of(evidence.after);
  effect.unit = findings.unit;
  effect.p_value = evidence.p_value;
  effect.probability = evidence.posterior.probability;
  effect.ambiguous_with = evidence.posterior.credible_others(kCredible);
  effect.size = std::abs(fit.coefficients[0]);
  effect.separate_by = form.separate_by();
  return effect;
}

const EffectForm& form_of(const ChannelFit& fit, const Chosen& chosen) {
  return *fit.model.candidates[chosen.candidate]->form;
}

/// A load whose shape the plant knows, its mean included.
bool has_a_place(const EffectForm& form) {
  const Weight weight = form.traits().weight;
  return weight == Weight::kOnTool || (weight == Weight::kOfLinks && form.nominal_term());
}

/// A load without a place in the plant is fitted without its mean, which the constant then is.
bool has_a_mean(const ChannelFit& fit) {
  return std::any_of(fit.model.chosen.begin(), fit.model.chosen.end(), [&](const Chosen& chosen) {
    const EffectForm& form = form_of(fit, chosen);
    return form.traits().weight == Weight::kOfLinks && !has_a_place(form);
  });
}

bool is_uneven(const std::string& id) { return traits_of(id).friction == Friction::kUneven; }

std::vector<NamedEffect>::iterator find_asymmetry(std::vector<NamedEffect>& effects) {
  return std::find_if(effects.begin(), effects.end(),
                      [](const NamedEffect& e) { return is_uneven(e.id); });
}

/// The fit without friction that differs by speed between the directions, which has a mean of its
/// own; none where it has no such friction.
std::optional<ChannelFit> without_asymmetry(const ChannelFit& fit) {
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    if (!is_uneven(form_of(fit, fit.model.chosen[i]).id())) continue;
    ChannelFit rest = fit;
    rest.model = fit.model.without(i);
    rest.coefficients = joint_fit(rest.model);
    return rest;
  }
  return std::nullopt;
}

/// Constant that loads leave which hang a little off the plant's place for them.
double hung_error(const ChannelFit& fit) {
  double sum = 0.0;
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const Chosen& chosen = fit.model.chosen[i];
    if (has_a_place(form_of(fit, chosen)))
      sum += std::abs((chosen.columns * coefficients_of(fit, i)).mean());
  }
  return kUnstatedTolerance * sum;
}

/// The constant as a homing offset, where all of its interval is larger than `least`.
std::optional<NamedEffect> offset_of(const ChannelFit& fit, const Interval& whole, double least,
                                     const ChannelOptions& options,
                                     const ChannelFindings& findings) {
  if (!leaves_out_zero(whole) || std::min(std::abs(whole.first), std::abs(whole.second)) < least)
    return std::nullopt;
  const auto form = homing_offset();
  const auto evidence = constant_evidence(fit, *form, options);
  if (!evidence) return std::nullopt;
  NamedEffect offset = effect_of(
      fit, *evidence, *form,
      constant_as("offset", 1.0, fit, findings.unit, derived_seed(options.seed, "offset")),
      findings);
  if (!offset.certain) return std::nullopt;
  return offset;
}

}  // namespace

VectorXd stretch_of(const ChannelFit& fit) {
  VectorXd stretch = fit.model.blocks.gather(fit.nominal->prediction);
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const Chosen& chosen = fit.model.chosen[i];
    if (chosen.everywhere.size() > 0) stretch += chosen.columns * coefficients_of(fit, i);
  }
  return stretch;
}

void name_offset(const ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                 ChannelFindings& findings) {
  const Series& series = *fit.model.series;
  if (series.stage != Stage::kTransmission) return;
  NotFound silent{homing_offset_kind().id(), findings.joint, std::nullopt, "", ""};
  silent.expected = plant_has(plant, series.joint, silent.id, "");
  if (silent.expected || !fit.model.has_constant()) {
    silent.not_testable_because =
        silent.expected ? "the plant draws a new offset at each homing: any is expected"
                        : "in this motion it looks like the mean of what loads do to the cable";
    findings.not_found.push_back(std::move(silent));
    return;
  }
  // Its whole interval: beside a drift the constant is where the drift began, which is known badly.
  const Interval whole =
      interval_over_time(fit, 0, derived_seed(options.seed, "offset chance"), Doubt::kChance);
  const double least = least_offset(fit, plant);
  if (auto offset = offset_of(fit, whole, least, options, findings)) {
    findings.effects.insert(findings.effects.begin(), std::move(*offset));
    return;
  }
  const double deviation = 0.5 * (whole.second - whole.first) / kNormal95;
  silent.detection_limit = least + (kNormal95 + kNineInTen) * deviation;
  silent.unit = findings.unit;
  silent.parameter = "offset";
  findings.not_found.push_back(std::move(silent));
}

void name_asymmetry(const ChannelFit& fit, const ChannelOptions& options,
                    ChannelFindings& findings) {
  const Series& series = *fit.model.series;
  // Without links the constant is as well a weight that the plant does not have.
  if (series.stage != Stage::kDrive || series.weight.size() == 0 || has_a_mean(fit)) return;
  const auto level = [&](const ChannelFit& of) {
    return constant_as("level_difference", 2.0, of, findings.unit,
                       derived_seed(options.seed, "level difference"));
  };
  const auto clear = [](const ChannelFit& of) {
    return std::abs(of.coefficients[0]) >=
           std::max({of.model.floor, form_error(of), hung_error(of)});
  };
  if (const auto named = find_asymmetry(findings.effects); named != findings.effects.end()) {
    if (!clear(fit)) return;
    NamedParameter beside = level(fit);
    if (leaves_out_zero(beside.ci95)) named->parameters.push_back(std::move(beside));
    return;
  }
  // What differs with speed and has no name is no reason against one for the constant beside it.
  const std::optional<ChannelFit> rest = without_asymmetry(fit);
  const ChannelFit& judged = rest ? *rest : fit;
  if (!clear(judged)) return;
  const auto form = level_difference();
  const auto evidence = constant_evidence(judged, *form, options);
  if (!evidence) return;
  NamedEffect difference = effect_of(judged, *evidence, *form, level(judged), findings);
  if (!difference.certain) return;
  if (const auto kept = find_asymmetry(findings.kept); kept != findings.kept.end()) {
    difference.parameters = kept->parameters;
    difference.parameters.insert(difference.parameters.begin(), level(fit));
    findings.kept.erase(kept);
  }
  findings.effects.push_back(std::move(difference));
}

}  // namespace ravencal::diagnose
