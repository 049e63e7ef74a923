// SPDX-License-Identifier: Apache-2.0
//
// Effects for which the evidence is too little for a name and which predict better all the same:
// they belong to the improved plant, as a constant too small for a name does. A name answers for
// its false alarms; a prediction answers for its error, on other stretches and in other positions.
#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/beyond.hpp"

namespace ravencal::diagnose {
namespace {

constexpr std::size_t kMostKept = 4;

/// The last effect's gain is repeated where blocks are held out in turn, and beyond what it was
/// fitted to.
bool predicts_better(const ChannelModel& with, const ChannelModel& without) {
  return z_score(held_out_errors(without) - held_out_errors(with)) >= kLeastKeptGain_z &&
         predicts_beyond(with, without);
}

/// A number of the plant is a verdict of its own, time alone says nothing of another recording, and
/// what hangs on the arm concerns all joints.
bool may_be_kept(const EffectForm& form) {
  return !form.nominal_term() && !form.time_only() && form.traits().weight != Weight::kOnTool;
}

bool is_certain(const ChannelFit& fit, std::size_t chosen, const ChannelOptions& options) {
  const Invariance invariance = invariance_of(fit.model, fit.coefficients, chosen);
  return certain(fit, chosen, sizes_of(fit, chosen, invariance, options));
}

/// Effects whose size is not nothing.
std::vector<char> certain_effects(const ChannelFit& fit, const ChannelOptions& options) {
  std::vector<char> out;
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i)
    out.push_back(is_certain(fit, i, options) ? 1 : 0);
  return out;
}

/// What is kept says something beside the effects that are there: none of them may come to nothing
/// beside it that did not before.
bool leaves_certain(ChannelFit& fit, ChannelModel& with, const std::vector<char>& before,
                    const ChannelOptions& options) {
  const Eigen::VectorXd coefficients = fit.coefficients;
  std::swap(fit.model, with);
  fit.coefficients = joint_fit(fit.model);
  bool leaves = true;
  for (std::size_t i = 0; leaves && i < before.size(); ++i)
    leaves = before[i] == 0 || is_certain(fit, i, options);
  std::swap(fit.model, with);
  fit.coefficients = coefficients;
  return leaves;
}

/// The likeliest effect that makes the model likelier and predicts better; none: no effects.
ChannelModel extended(ChannelFit& fit, const ChannelOptions& options) {
  const ChannelModel& model = fit.model;
  const ScreenResult result = screen(model, options.gates, derived_seed(options.seed, "kept"));
  const std::vector<char> before = certain_effects(fit, options);
  double least = score_of(model);
  ChannelModel best;
  for (const TestedCandidate& tested : result.tested) {
    if (!tested.consistent || !may_be_kept(*model.candidates[tested.candidate]->form)) continue;
    ChannelModel with = model.with(tested.best);
    const double score = score_of(with) + effect_cost(freedom_of(model, tested.best));
    if (score >= least || !last_is_consistent(with) || !predicts_better(with, model) ||
        !leaves_certain(fit, with, before, options))
      continue;
    least = score;
    best = std::move(with);
  }
  return best;
}

}  // namespace

void keep_without_name(ChannelFit& fit, const ChannelOptions& options) {
  while (fit.kept < kMostKept) {
    ChannelModel more = extended(fit, options);
    if (more.chosen.empty()) break;
    fit.model = std::move(more);
    fit.coefficients = joint_fit(fit.model);
    ++fit.kept;
  }
}

void take_values_of(ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                    ChannelFindings& findings) {
  ChannelFindings anew;
  anew.joint = findings.joint;
  anew.stage = findings.stage;
  anew.unit = findings.unit;
  name_effects(fit, options, anew);
  name_offset(fit, plant, options, anew);
  name_asymmetry(fit, options, anew);
  const auto same = [](const NamedEffect& a, const NamedEffect& b) {
    return a.id == b.id && a.from == b.from && a.out_of_tolerance == b.out_of_tolerance;
  };
  findings.kept.clear();
  for (const auto* list : {&anew.effects, &anew.kept}) {
    for (const NamedEffect& e : *list) {
      const auto named = std::find_if(findings.effects.begin(), findings.effects.end(),
                                      [&](const NamedEffect& other) { return same(e, other); });
      if (named != findings.effects.end() && e.certain) {
        named->parameters = e.parameters;
        continue;
      }
      // Beside what is kept it may be nothing.
      if (named != findings.effects.end()) findings.effects.erase(named);
      if (!traits_of(e.id).constant && !e.out_of_tolerance) findings.kept.push_back(e);
    }
  }
}

}  // namespace ravencal::diagnose
