// SPDX-License-Identifier: Apache-2.0
//
// Steps of the transmission at one moment: what they are called.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"
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
  const double size = std::abs(step.size);
  if (near > kLostShare * size && near > 2.0 * usual) return StepKind::kLostCounts;
  const bool visible = usual < kKickShare * size * left_after_a_sample(s);
  return visible && near < kKickShare * size ? StepKind::kSlip : StepKind::kEither;
}

}  // namespace

void name_steps(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  const ChannelModel& model = fit.model;
  if (model.steps.empty()) return;
  // Beside structure that has no name a step is part of that structure.
  if (fit.unnamed && fit.unnamed->depends_on.front() != "time") return;
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
  for (std::size_t k = 0; k < model.steps.size(); ++k) {
    const Step& step = model.steps[k];
    NamedEffect effect;
    const StepKind kind = kind_of(step, *model.series);
    effect.id = (kind == StepKind::kLostCounts ? lost_counts_kind() : slip_kind()).id();
    effect.joint = findings.joint;
    effect.stage = reported_stage(effect.id, findings.stage);
    // What lies around a step finds it; its size, and whether it may as well be nothing, is what
    // all rows before and after say.
    const double size = fit.coefficients[model.step_at(k)];
    const auto ci95 = interval_over_time(
        fit, model.step_at(k), derived_seed(options.seed, "step sizes", k), Doubt::kFormToo);
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
    effect.size = std::abs(size);
    std::vector<std::string> same;
    if (kind == StepKind::kEither) same = {lost_counts_kind().id()};
    const EffectPosterior posterior = posterior_of_step(
        model, k, effect.id, same, derived_seed(options.seed, "step posterior", k));
    effect.probability = posterior.probability;
    effect.ambiguous_with = posterior.credible_others(kCredible);
    effect.separate_by =
        "record the drive's command at that moment: lost counts make the servo jump, a slipping "
        "cable does not";
    findings.effects.push_back(std::move(effect));
  }
}

}  // namespace ravencal::diagnose
