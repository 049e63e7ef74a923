// SPDX-License-Identifier: Apache-2.0
//
// What a channel's fit found, in the vocabulary's names.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/invariance.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

enum class StepKind { kSlip, kLostCounts, kEither };

/// Lost counts make the controller see a jump that never happened: the recorded position leaves the
/// desired one by the step's size, and the servo brings it back. A slipping cable shows no such
/// jump.
StepKind kind_of(const Step& step, const Series& s) {
  if (s.tracking_error.size() == 0 || s.rows() < 200) return StepKind::kEither;
  VectorXd jump = VectorXd::Zero(s.rows());
  for (Index i = 2; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.fresh[n] != 0 || s.fresh[n - 1] != 0) continue;
    const double change = s.tracking_error[i] - s.tracking_error[i - 2];
    if (std::isfinite(change)) jump[i] = change;
  }
  const Index reach = std::max<Index>(20, step.window);
  double near = 0.0;
  std::vector<double> elsewhere;
  for (Index i = 0; i < s.rows(); ++i) {
    const bool inside = std::abs(i - step.row) <= reach;
    if (inside && jump[i] * step.size > 0.0) near = std::max(near, std::abs(jump[i]));
    if (!inside) elsewhere.push_back(std::abs(jump[i]));
  }
  if (elsewhere.size() < 200) return StepKind::kEither;
  const auto rank = elsewhere.begin() +
                    static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(elsewhere.size()));
  std::nth_element(elsewhere.begin(), rank, elsewhere.end());
  if (near > 0.3 * std::abs(step.size) && near > 2.0 * *rank) return StepKind::kLostCounts;
  const double period_s =
      (s.t_s[s.rows() - 1] - s.t_s[0]) / static_cast<double>(std::max<Index>(1, s.rows() - 1));
  // The servo needs some 50 ms: slower recordings may miss its jump between two samples.
  const bool visible = period_s < 0.02 && *rank < 0.3 * std::abs(step.size);
  return visible ? StepKind::kSlip : StepKind::kEither;
}

VectorXd errors_of(const ChannelModel& model) {
  const MatrixXd columns = model.columns();
  return held_out_error(model.blocks, moments_of(model.blocks, columns, model.target),
                        model.column_precision(columns.cols()));
}

/// Rivals that explain the data as well in the place of an effect.
std::vector<std::string> rivals_of(const ChannelFit& fit, std::size_t chosen,
                                   const ChannelOptions& options) {
  const ChannelModel& model = fit.model;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  std::vector<std::string> rivals = form.twins(*model.series);
  const ScreenResult result = screen(model.without(chosen), options.gates, options.seed);
  const VectorXd present = errors_of(model);
  const VectorXd part = own.columns * coefficients_of(fit, chosen);
  for (const TestedCandidate& t : result.tested) {
    const EffectForm& other = *model.candidates[t.candidate]->form;
    if (t.candidate == own.candidate || other.id() == form.id()) continue;
    if (!repeats(options.gates, t.evidence.z, t.evidence.block_p)) continue;
    ChannelModel with = model.without(chosen);
    with.chosen.push_back(t.best);
    with.hold_nominal();
    if (!last_is_consistent(with)) continue;
    const VectorXd difference = errors_of(with) - present;
    const auto count = static_cast<double>(difference.size());
    const double mean = difference.mean();
    const double error =
        std::sqrt((difference.array() - mean).square().sum() / (count - 1.0) / count);
    if (mean > 2.0 * error) continue;
    // A richer form that contains this one explains as much by necessity.
    const MatrixXd& z = t.best.columns;
    const VectorXd imitation =
        z * (z.transpose() * z + 1e-12 * MatrixXd::Identity(z.cols(), z.cols()))
                .ldlt()
                .solve(z.transpose() * part);
    const bool richer = z.cols() + static_cast<Index>(t.best.shape.size()) >
                        own.columns.cols() + static_cast<Index>(own.shape.size());
    if (richer && (part - imitation).squaredNorm() < 0.05 * part.squaredNorm()) continue;
    rivals.push_back(other.id());
  }
  std::sort(rivals.begin(), rivals.end());
  rivals.erase(std::unique(rivals.begin(), rivals.end()), rivals.end());
  std::erase(rivals, form.id());
  return rivals;
}

/// An effect that so many others could stand for is not named.
constexpr std::size_t kTooManyRivals = 4;

}  // namespace

void name_steps(const ChannelFit& fit, ChannelFindings& findings) {
  if (fit.steps.empty()) return;
  // Beside structure that has no name a step is part of that structure.
  if (fit.unnamed && fit.unnamed->depends_on.front() != "time") return;
  const ChannelModel& model = fit.model;
  // Everything but the steps, for what they explain.
  ChannelModel without = model;
  const auto kept = static_cast<Index>(1 + fit.nominal.terms.size());
  without.base = model.base.leftCols(kept).eval();
  without.precision = model.precision.head(kept).eval();
  const VectorXd before = errors_of(without);
  const VectorXd after = errors_of(model);
  // The size gate of all effects: what the steps take off the held-out error, not their height.
  const double gained = std::sqrt(std::max(0.0, (before - after).sum()) /
                                  static_cast<double>(std::max<Index>(1, model.target.size())));
  if (gained < Gates{}.size_per_floor * model.floor) return;
  for (std::size_t k = 0; k < fit.steps.size(); ++k) {
    const Step& step = fit.steps[k];
    NamedEffect effect;
    const StepKind kind = kind_of(step, *model.series);
    effect.id = kind == StepKind::kLostCounts ? "lost_counts" : "slip";
    effect.joint = findings.joint;
    effect.stage = stage_word(findings.stage);
    const double size = fit.coefficients[step_index(fit, k)];
    if (std::abs(size) < 1.96 * step.deviation) continue;
    effect.parameters = {
        {"size", size, findings.unit, {size - 1.96 * step.deviation, size + 1.96 * step.deviation}},
        {"time", step.t_s, "s", {step.t_s, step.t_s}}};
    effect.held_out_before = model.rms_of(before);
    effect.held_out_after = model.rms_of(after);
    effect.unit = findings.unit;
    effect.p_value = sign_flip_p(before - after, 1);
    effect.size = std::abs(size);
    if (kind == StepKind::kEither) effect.ambiguous_with = {"lost_counts"};
    effect.separate_by =
        "record the drive's command at that moment: lost counts make the servo jump, a slipping "
        "cable does not";
    findings.effects.push_back(std::move(effect));
  }
}

void name_effects(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    const EffectForm& form = *fit.model.candidates[fit.model.chosen[i].candidate]->form;
    const Evidence evidence = evidence_of(fit.model, i, options.gates, options.seed + 100 + i);
    NamedEffect effect;
    effect.id = form.id();
    effect.from = form.from();
    effect.joint = findings.joint;
    effect.stage = stage_word(findings.stage);
    effect.parameters = parameters_of(fit, i, options.seed + 200 + i);
    effect.held_out_before = evidence.held_out_before;
    effect.held_out_after = evidence.held_out_after;
    effect.unit = findings.unit;
    effect.p_value = evidence.p_value;
    effect.size = evidence.size;
    const Invariance invariance = invariance_of(fit.model, fit.coefficients, i);
    widen_by_circumstances(invariance, effect.parameters);
    effect.invariance_spread = invariance.spread;
    effect.ambiguous_with = rivals_of(fit, i, options);
    if (effect.ambiguous_with.size() >= kTooManyRivals) {
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
      continue;
    }
    effect.separate_by = form.separate_by();
    effect.out_of_tolerance = form.nominal_term().has_value();
    findings.effects.push_back(std::move(effect));
  }
}

void name_offset(ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                 ChannelFindings& findings) {
  const Series& series = *fit.model.series;
  if (series.stage != Stage::kTransmission) return;
  if (plant_has(plant, series.joint, "homing_offset", "")) {
    findings.not_found.push_back({"homing_offset", findings.joint, std::nullopt, "",
                                  "the plant draws a new offset at each homing: any is expected"});
    return;
  }
  ChannelModel without = fit.model;
  without.base = fit.model.base.rightCols(fit.model.base.cols() - 1).eval();
  without.precision = fit.model.precision.tail(fit.model.precision.size() - 1).eval();
  const auto form = homing_offset();
  auto candidate = std::make_shared<Candidate>();
  candidate->form = form.get();
  candidate->shapes = {{}};
  candidate->columns = {MatrixXd::Ones(fit.model.target.size(), 1)};
  without.candidates = {candidate};
  for (const Chosen& chosen : fit.model.chosen)
    without.candidates.push_back(fit.model.candidates[chosen.candidate]);
  for (std::size_t i = 0; i < without.chosen.size(); ++i) without.chosen[i].candidate = i + 1;
  const ScreenResult result = screen(without, options.gates, options.seed + 300);
  if (result.tested.empty() || result.tested.front().candidate != 0) return;
  const TestedCandidate& tested = result.tested.front();
  const auto joint = plant.joint_index(series.joint).value_or(0);
  const double expected = 3.0 * plant.joints[joint].parameter("homing_offset", "deviation");
  const double offset = fit.coefficients[0];
  double passed_on = 0.0;
  for (const Inherited& part : series.inherited) passed_on += std::abs(part.offset);
  const Evidence& e = tested.evidence;
  if (!repeats(options.gates, e.z, e.block_p) || e.p_value > options.gates.alpha ||
      e.share < options.gates.least_share ||
      std::abs(offset) < std::max({expected, fit.model.floor, 1.25 * passed_on})) {
    return;
  }
  NamedEffect effect;
  effect.id = "homing_offset";
  effect.joint = findings.joint;
  effect.stage = stage_word(findings.stage);
  // Spread of the blocks' means, blocks as observations.
  const auto blocks = static_cast<double>(fit.model.blocks.count());
  VectorXd means(static_cast<Index>(blocks));
  for (std::size_t b = 0; b < fit.model.blocks.count(); ++b) {
    means[static_cast<Index>(b)] =
        fit.held_out_residual.segment(fit.model.blocks.first(b), fit.model.blocks.size(b)).mean();
  }
  const double error =
      1.96 * std::sqrt((means.array() - means.mean()).square().sum() / (blocks - 1.0) / blocks);
  effect.parameters = {{"offset", offset, findings.unit, {offset - error, offset + error}}};
  effect.held_out_before = e.held_out_before;
  effect.held_out_after = e.held_out_after;
  effect.unit = findings.unit;
  effect.p_value = e.p_value;
  effect.size = std::abs(offset);
  effect.separate_by = form->separate_by();
  findings.effects.insert(findings.effects.begin(), std::move(effect));
}

void name_refitted(const ChannelFit& fit, ChannelFindings& findings) {
  for (std::size_t t = 0; t < fit.nominal.terms.size(); ++t) {
    const NominalTerm& term = fit.nominal.terms[t];
    const double change = fit.coefficients[static_cast<Index>(t) + 1];
    const bool load = term.id == "gravity" || term.id == "joint_friction";
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
  offset.id = "homing_offset";
  offset.joint = findings.joint;
  offset.stage = stage_word(findings.stage);
  const double value = fit.coefficients[0];
  offset.parameters = {{"offset", value, findings.unit, {value, value}}};
  findings.refitted.push_back(std::move(offset));
}

void add_candidates(const ChannelFit& fit, const ChannelOptions& options,
                    ChannelFindings& findings) {
  const ScreenResult result = screen(fit.model, options.gates, options.seed + 400);
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
      outcome = "smaller than a third of the floor";
    findings.candidates.push_back({findings.joint, std::string(stage_word(findings.stage)),
                                   form.key(), e.share, e.z, e.p_value, e.size, findings.unit,
                                   outcome});
  }
}

}  // namespace ravencal::diagnose
