// SPDX-License-Identifier: Apache-2.0
//
// Steps of the transmission at one moment: which of those found are real, and what they are called.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"
#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/posterior.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

enum class StepKind { kSlip, kLostCounts, kEither };

/// Leap of the tracking error over `lag` samples that end at i, beyond how it moves before and
/// after.
double leap_at(const VectorXd& error, Index i, Index lag) {
  const double change = error[i] - error[i - lag];
  const double before = change - (error[i - lag] - error[i - 2 * lag]);
  const double after = change - (error[i + lag] - error[i]);
  if (!std::isfinite(before) || !std::isfinite(after) || before * after <= 0.0) return 0.0;
  return std::abs(before) < std::abs(after) ? before : after;
}

/// The larger leap over one or two samples: a servo's error follows its motion smoothly, and only
/// what the encoder miscounted comes at once, or split between two rows that are means of several.
VectorXd leaps_of(const Series& s) {
  constexpr Index kLags = 2;
  VectorXd leap = VectorXd::Zero(s.rows());
  for (Index i = 2 * kLags; i + kLags < s.rows(); ++i) {
    const auto first = s.fresh.begin() + (i - 2 * kLags + 1);
    if (std::find_if(first, first + 3 * kLags, [](char f) { return f != 0; }) != first + 3 * kLags)
      continue;
    const double one = leap_at(s.tracking_error, i, 1);
    const double two = leap_at(s.tracking_error, i, kLags);
    leap[i] = std::abs(one) > std::abs(two) ? one : two;
  }
  return leap;
}

/// Share of a lost count's leap that the servo has not yet made good one sample later, at worst.
double left_after_a_sample(const Series& s) {
  constexpr double kServo_s = 0.05;  // of a servo that nobody describes
  const bool known = s.servo && s.servo->position > 0.0 && s.servo->rate > 0.0;
  const double servo_s = known ? s.servo->rate / s.servo->position : kServo_s;
  const double period_s =
      (s.t_s[s.rows() - 1] - s.t_s[0]) / static_cast<double>(std::max<Index>(1, s.rows() - 1));
  return std::exp(-period_s / servo_s);
}

/// Lost counts make the controller see a jump that never happened: the recorded position leaves the
/// desired one by the step's size, and the servo brings it back. A slipping cable shows no such
/// jump.
StepKind kind_of(const Step& step, const Series& s) {
  if (s.tracking_error.size() == 0 || s.rows() < 200) return StepKind::kEither;
  const VectorXd leaps = leaps_of(s);
  const Index reach = std::max<Index>(20, step.window);
  double near = 0.0;
  std::vector<double> elsewhere;
  for (Index i = 0; i < s.rows(); ++i) {
    const bool inside = std::abs(i - step.row) <= reach;
    if (inside && leaps[i] * step.size > 0.0) near = std::max(near, std::abs(leaps[i]));
    if (!inside) elsewhere.push_back(std::abs(leaps[i]));
  }
  if (elsewhere.size() < 200) return StepKind::kEither;
  const double usual = core::upper_quantile(std::move(elsewhere), 0.999);
  // The tension that a slip lets go kicks the motor as well, but by less than the step.
  constexpr double kLostShare = 0.4, kKickShare = 0.3;
  const double size = std::abs(step.size);
  if (near > kLostShare * size && near > 2.0 * usual) return StepKind::kLostCounts;
  const bool visible = usual < kKickShare * size * left_after_a_sample(s);
  return visible && near < kKickShare * size ? StepKind::kSlip : StepKind::kEither;
}

/// The model without one step of its base.
ChannelModel without_step(const ChannelFit& fit, std::size_t step) {
  ChannelModel out = fit.model;
  const Index at = step_index(fit, step);
  const auto erase = [at](Eigen::MatrixXd& x) {
    const Index behind = x.cols() - at - 1;
    x.middleCols(at, behind) = x.rightCols(behind).eval();
    x.conservativeResize(Eigen::NoChange, x.cols() - 1);
  };
  erase(out.base);
  erase(out.free_base);
  const Index behind = out.precision.size() - at - 1;
  out.precision.segment(at, behind) = out.precision.tail(behind).eval();
  out.precision.conservativeResize(out.precision.size() - 1);
  out.hold_nominal();
  return out;
}

/// True if the step says clearly more than a constant of the whole stretch that it is in: homing
/// may have changed from one start to the next.
bool is_within_its_stretch(const ChannelFit& fit, std::size_t step) {
  const Series& s = *fit.model.series;
  Step whole = fit.steps[step];
  while (whole.row > 0 && s.fresh[static_cast<std::size_t>(whole.row)] == 0) --whole.row;
  const VectorXd column = fit.model.blocks.gather(step_column(s, whole)).col(0);
  if (same_column(column, VectorXd::Ones(column.size()))) return true;
  ChannelModel other = fit.model;
  const Index at = step_index(fit, step);
  other.base.col(at) = column;
  other.free_base.col(at) = column;
  other.hold_nominal();
  return held_out_errors(other).sum() - held_out_errors(fit.model).sum() >
         kClearScore * noise_unit(fit.model);
}

/// Cost of effects and steps and what they leave; steps have a size and a time.
double score_of(const ChannelModel& model, std::size_t steps, double unit) {
  double score = held_out_errors(model).sum() / unit + nominal_cost(model, joint_fit(model)) +
                 static_cast<double>(steps) * effect_cost(2);
  for (const Chosen& chosen : model.chosen) score += effect_cost(freedom_of(model, chosen));
  return score;
}

}  // namespace

void keep_proven_steps(ChannelFit& fit, const ChannelModel& without_steps,
                       const ChannelOptions& options) {
  if (fit.steps.empty()) return;
  for (std::size_t k = fit.steps.size(); k-- > 0;) {
    ChannelModel rest = without_step(fit, k);
    const VectorXd before = held_out_errors(rest);
    const VectorXd gains = before - held_out_errors(fit.model);
    const bool proven = repeats(options.gates, z_score(gains),
                                sign_flip_p(gains, derived_seed(options.seed, "steps", k))) &&
                        gains.sum() > options.gates.least_share * before.sum() &&
                        is_within_its_stretch(fit, k);
    if (proven) continue;
    fit.steps.erase(fit.steps.begin() + static_cast<std::ptrdiff_t>(k));
    fit.model = std::move(rest);
  }
  ChannelModel plain = without_steps;
  select_effects(plain, options.gates, options.seed);
  const double unit = std::min(noise_unit(plain), noise_unit(fit.model));
  if (!fit.steps.empty() && score_of(fit.model, fit.steps.size(), unit) < score_of(plain, 0, unit))
    return;
  fit.steps.clear();
  fit.model = std::move(plain);
}

void name_steps(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  if (fit.steps.empty()) return;
  // Beside structure that has no name a step is part of that structure.
  if (fit.unnamed && fit.unnamed->depends_on.front() != "time") return;
  const ChannelModel& model = fit.model;
  // Everything but the steps, for what they explain.
  ChannelModel without = model;
  const auto kept = static_cast<Index>(1 + fit.nominal->terms.size());
  without.base = model.base.leftCols(kept).eval();
  without.precision = model.precision.head(kept).eval();
  const VectorXd before = held_out_errors(without);
  const VectorXd after = held_out_errors(model);
  // The size gate of all effects: what the steps take off the held-out error, not their height.
  const double gained = std::sqrt(std::max(0.0, (before - after).sum()) /
                                  static_cast<double>(std::max<Index>(1, model.target.size())));
  if (gained < Gates{}.size_per_floor * model.floor) return;
  const double independent =
      0.5 * static_cast<double>(model.target.size()) / model.correlation_rows;
  for (std::size_t k = 0; k < fit.steps.size(); ++k) {
    const Step& step = fit.steps[k];
    NamedEffect effect;
    const StepKind kind = kind_of(step, *model.series);
    effect.id = (kind == StepKind::kLostCounts ? lost_counts_kind() : slip_kind()).id();
    effect.joint = findings.joint;
    effect.stage = reported_stage(effect.id, findings.stage);
    // What lies around a step finds it; its size, and whether it may as well be nothing, is what
    // all rows before and after say.
    const double size = fit.coefficients[step_index(fit, k)];
    const auto ci95 = interval_over_time(
        fit, step_index(fit, k), derived_seed(options.seed, "step sizes", k), Doubt::kFormToo);
    const double deviation = (ci95.second - ci95.first) / (2.0 * kNormal95);
    if (std::abs(size) < kNormal95 * step.deviation ||
        chance_anywhere(std::abs(size) / deviation, independent) > kStepChance)
      continue;
    effect.parameters = {{"size", size, findings.unit, ci95},
                         {"time", step.t_s, "s", {step.t_s, step.t_s}}};
    effect.held_out_before = model.rms_of(before);
    effect.held_out_after = model.rms_of(after);
    effect.unit = findings.unit;
    effect.p_value = step.p_value;
    effect.probability = probability_at(step.p_value);
    effect.size = std::abs(size);
    if (kind == StepKind::kEither) effect.ambiguous_with = {lost_counts_kind().id()};
    effect.separate_by =
        "record the drive's command at that moment: lost counts make the servo jump, a slipping "
        "cable does not";
    findings.effects.push_back(std::move(effect));
  }
}

}  // namespace ravencal::diagnose
