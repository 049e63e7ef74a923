// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/channel.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/channel/homings.hpp"
#include "diagnose/channel/placebo.hpp"
#include "diagnose/channel/settling.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Forms candidates_for(const Series& series, const physics::Plant& plant, const Nominal& nominal,
                     const VectorXd& further_load) {
  Forms forms;
  for (auto& form : forms_for(series, nominal, further_load)) {
    if (!plant_has(plant, series.joint, form->id(), form->from())) forms.push_back(std::move(form));
  }
  for (std::size_t t = 0; t < nominal.terms.size(); ++t) {
    if (!nominal.terms[t].form_only && !nominal.terms[t].beyond_is_effect)
      forms.push_back(tolerance_form(nominal.terms[t], t));
  }
  return forms;
}

void predict(ChannelFit& fit) {
  const Series& series = *fit.model.series;
  VectorXd prediction = fit.nominal->prediction;
  VectorXd before = fit.model.target;
  if (series.payload_effort.size() > 0) {
    const VectorXd seen = series.as_seen(series.payload_effort);
    prediction += seen;
    before += fit.model.blocks.gather(seen);
  }
  prediction.array() += fit.coefficients[0];
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t) {
    prediction += fit.coefficients[static_cast<Index>(t) + 1] * fit.nominal->terms[t].column;
  }
  for (std::size_t k = 0; k < fit.model.steps.size(); ++k) {
    prediction += fit.coefficients[fit.model.step_at(k)] * step_column(series, fit.model.steps[k]);
  }
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const Chosen& chosen = fit.model.chosen[i];
    const MatrixXd columns =
        chosen.everywhere.size() > 0
            ? MatrixXd(chosen.everywhere)
            : seen_columns(*fit.model.candidates[chosen.candidate]->form, series, chosen.shape);
    prediction += columns * coefficients_of(fit, i);
  }
  fit.prediction = prediction;
  const MatrixXd columns = fit.model.columns();
  fit.held_out_residual =
      held_out_residual(fit.model.blocks, moments_of(fit.model.blocks, columns, fit.model.target),
                        fit.model.column_precision(columns.cols()), columns, fit.model.target);
  fit.base_residual =
      held_out_residual(fit.model.blocks, moments_of(fit.model.blocks, fit.model.base, before),
                        fit.model.precision, fit.model.base, before);
}

/// Effort that depends on posture, where the plant has no links to carry it.
VectorXd posture_effort(const ChannelFit& fit) {
  const Series& s = *fit.model.series;
  VectorXd found;
  if (s.stage != Stage::kDrive) return found;
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const Chosen& chosen = fit.model.chosen[i];
    const EffectForm& form = *fit.model.candidates[chosen.candidate]->form;
    if (form.traits().weight == Weight::kOfLinks && !form.nominal_term())
      found = form.columns(s, chosen.shape) * coefficients_of(fit, i);
  }
  return found;
}

/// Weight at the tool that the drive's fit or the whole arm found, kg; 0 if none.
double hung_kg(const ChannelFit& fit) {
  const Series& s = *fit.model.series;
  if (s.stage != Stage::kDrive) return 0.0;
  if (s.payload_effort.size() > 0) return s.payload_kg;
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const EffectForm& form = *fit.model.candidates[fit.model.chosen[i].candidate]->form;
    if (form.traits().weight == Weight::kOnTool) return coefficients_of(fit, i)[0];
  }
  return 0.0;
}

/// What the drive's channel says of the joint's load: effort beyond the plant's weight, and how
/// well all of it is known.
void add_load(const ChannelFit& fit, std::uint64_t seed, ChannelFindings& findings) {
  const Series& s = *fit.model.series;
  if (s.stage != Stage::kDrive) return;
  findings.found_load = posture_effort(fit);
  if (s.weight.size() == 0) {
    if (findings.found_load.size() > 0) findings.weight_deviation = kLeastWeightDeviation;
    return;
  }
  if (findings.found_load.size() == 0) findings.found_load = VectorXd::Zero(s.rows());
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t) {
    if (traits_of(fit.nominal->terms[t].id).weight == Weight::kNone) continue;
    // A weight at its limit stands for something else as well, which the cable does not carry.
    if (fit.model.held[t] != 0.0) {
      findings.weight_deviation = fit.nominal->terms[t].tolerance;
      continue;
    }
    findings.found_load += fit.coefficients[static_cast<Index>(t) + 1] * s.weight;
    const double deviation = nominal_deviation(fit, seed)[static_cast<Index>(t)];
    findings.weight_deviation = std::max(2.0 * deviation, kLeastWeightDeviation);
  }
  if (const double hung = hung_kg(fit); hung != 0.0) findings.found_load += hung * s.payload_per_kg;
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const EffectForm& form = *fit.model.candidates[fit.model.chosen[i].candidate]->form;
    if (form.traits().weight == Weight::kOfLinks && form.nominal_term())
      findings.found_load += coefficients_of(fit, i)[0] * s.weight;
  }
}

/// Numbers, errors and figures of the model as it stands.
void complete(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  findings.offset = fit.coefficients[0];
  findings.posture = posture_effort(fit);
  if (const double kg = hung_kg(fit); kg != 0.0) {
    const VectorXd hung = kg * payload()->columns(*fit.model.series, {}).col(0);
    findings.posture = findings.posture.size() > 0 ? VectorXd(findings.posture + hung) : hung;
  }
  if (options.details) name_refitted(fit, findings);
  add_held_out(fit, findings);
  if (options.details) add_plot(fit, findings);
}

/// Turns in which a load and the friction under it are found, or what others do to a joint and its
/// loops; and the change below which another turn says nothing new.
constexpr int kTurns = 3;

/// Nominal terms, effects and steps of a channel, chosen anew.
void fit_once(const Series& series, const physics::Plant& plant, const ChannelOptions& options,
              const VectorXd& further_load, ChannelFit& fit, std::vector<std::string>& notes) {
  fit.model = {};
  fit.nominal = std::make_shared<Nominal>(nominal_of(series, plant));
  fit.forms = candidates_for(series, plant, *fit.nominal, further_load);
  fit.model = prepare_channel(series, *fit.nominal, fit.forms);
  const std::string gross = temper_gross_rows(fit.model);
  if (!gross.empty()) notes.push_back(gross);
  choose_model(fit, plant, options, notes);
}

}  // namespace

VectorXd coefficients_of(const ChannelFit& fit, std::size_t chosen) {
  return fit.coefficients.segment(fit.model.first_column(chosen),
                                  fit.model.chosen[chosen].columns.cols());
}

std::unique_ptr<ChannelFit> fit_channel(const Series& recorded, const physics::Plant& plant,
                                        const ChannelOptions& options, ChannelFindings& findings) {
  // What hangs on the arm rubs as well, and a homing's constant is seen beside what effects do, so
  // that they are found in turns.
  auto owner = std::make_unique<ChannelFit>();
  ChannelFit& fit = *owner;
  fit.series = homed_series(recorded, plant);
  const Series& series = *fit.series;
  follow_others(fit, plant);
  VectorXd further_load;
  if (series.payload_effort.size() > 0) further_load = series.payload_kg * series.payload_per_kg;
  for (int turn = 0; turn < kTurns; ++turn) {
    std::vector<std::string> notes;
    fit_once(series, plant, options, further_load, fit, notes);
    const double hung = hung_kg(fit);
    VectorXd found;
    if (hung != 0.0) found = hung * series.payload_per_kg;
    const bool known =
        found.size() == 0 ||
        (further_load.size() > 0 && (found - further_load).norm() < kSettled * found.norm());
    further_load = std::move(found);
    const bool moved = follow_others(fit, plant) > kSettled;
    const bool last = turn + 1 == kTurns;
    if (!last && (!known || moved || take_out_homings(fit))) continue;
    findings.notes.insert(findings.notes.end(), notes.begin(), notes.end());
    break;
  }
  settle_loops(fit, plant);
  if (options.details) {
    if (auto shape = likeliest_shape(fit, options)) fit.unnamed = std::move(shape->what);
  }
  predict(fit);
  const auto share = settle_at_rest(fit);
  if (share && *share < 0.9) {
    findings.notes.push_back(fmt::format("at rest, joint {} carries {:.0f} % of its friction",
                                         series.joint, 100.0 * *share));
  }
  return owner;
}

NamedChannel name_channel(const Series& series, const physics::Plant& plant,
                          const ChannelOptions& options) {
  NamedChannel named;
  ChannelFindings& findings = named.findings;
  findings.joint = series.joint;
  findings.stage = series.stage;
  findings.unit = series.unit;
  named.fit = fit_channel(series, plant, options, findings);
  ChannelFit& fit = *named.fit;
  name_effects(fit, options, findings);
  name_offset(fit, plant, options, findings);
  name_asymmetry(fit, options, findings);
  name_steps(fit, options, findings);
  findings.floor = fit.model.floor;
  add_load(fit, derived_seed(options.seed, "load"), findings);
  findings.constant_load = fit.coefficients[0];
  return named;
}

ChannelFindings describe(const NamedChannel& named, const physics::Plant& plant,
                         const ChannelOptions& options) {
  const ChannelFit& fit = *named.fit;
  ChannelFindings findings = named.findings;
  if (options.details) {
    add_remainder(fit, options, findings);
    add_tone(fit, options, findings);
    add_location(fit, options, findings);
    add_limits(fit, options, findings);
    add_candidates(fit, options, findings);
    findings.friction_behind = friction_behind(fit, options);
    findings.placebo = std::make_shared<PlaceboParts>(placebo_parts(fit));
  }
  ChannelFindings bare = findings;
  complete(fit, options, bare);
  if (!options.details) return bare;
  ChannelFit more = fit;
  keep_without_name(more, options);
  if (more.kept == 0) return bare;
  settle_loops(more, plant);
  predict(more);
  settle_at_rest(more);
  take_values_of(more, plant, options, findings);
  complete(more, options, findings);
  if (findings.stage == Stage::kDrive)
    findings.bare = std::make_shared<ChannelFindings>(std::move(bare));
  return findings;
}

ChannelFindings analyse_channel(const Series& series, const physics::Plant& plant,
                                const ChannelOptions& options) {
  return describe(name_channel(series, plant, options), plant, options);
}

}  // namespace ravencal::diagnose
