// SPDX-License-Identifier: Apache-2.0
//
// The decision about a channel's model. Hypotheses are whole models: what the search for effects
// reaches with and without steps, with and without a constant. The likeliest one is taken whose
// effects are certain of their size and have one size under all circumstances.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/contenders.hpp"
#include "diagnose/selection/invariance.hpp"
#include "diagnose/selection/search.hpp"
#include "diagnose/selection/with_steps.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::VectorXd;

void append(std::vector<ChannelModel>& to, std::vector<ChannelModel> from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

/// A free constant hides the mean of what motion and loads do to the cable, which may be all that
/// is seen of it; but not that of one which the plant draws at each homing.
bool constant_may_hide(const ChannelModel& model, const physics::Plant& plant, const Gates& gates) {
  if (model.series->stage != Stage::kTransmission ||
      plant_has(plant, model.series->joint, homing_offset_kind().id(), ""))
    return false;
  return std::abs(joint_fit(model)[0]) >= gates.size_per_floor * model.floor &&
         penalised_score(without_constant(model)) >= penalised_score(model);
}

/// What the search reaches, likeliest first.
std::vector<ChannelModel> reached(const ChannelModel& plain, const physics::Plant& plant,
                                  const ChannelOptions& options) {
  const Gates& gates = options.gates;
  std::vector<ChannelModel> models = search_effects(plain, gates, options.seed);
  if (const auto stepped = with_steps(plain)) {
    for (ChannelModel& model : search_effects(*stepped, gates, options.seed)) {
      drop_unproven_steps(model, gates, options.seed);
      if (!model.steps.empty()) models.push_back(std::move(model));
    }
    sort_by_score(models);
  }
  if (!constant_may_hide(models.front(), plant, gates)) return models;
  ChannelModel bare = without_constant(models.front());
  bare.chosen.clear();
  bare.hold_nominal();
  auto constantless = search_effects(bare, gates, derived_seed(options.seed, "without constant"));
  for (ChannelModel& model : constantless) model.noise = models.front().noise;
  append(models, std::move(constantless));
  sort_by_score(models);
  return models;
}

/// True if the first parameter of a chosen effect may as well be zero, drawn over blocks: the model
/// has other ways to say the same.
bool uncertain(const ChannelFit& fit, std::size_t i, const ChannelOptions& options) {
  const EffectForm& form = *fit.model.candidates[fit.model.chosen[i].candidate]->form;
  // A number of the plant that the others' company turned into none.
  const bool consistent =
      !form.nominal_term() ||
      form.inconsistency(*fit.model.series, {}, coefficients_of(fit, i)).empty();
  if (!consistent) return true;
  // Of several columns no single one need be certain.
  if (fit.model.chosen[i].columns.cols() > 1) return false;
  const auto parameters =
      parameters_of(fit, i, derived_seed(options.seed, "certainty", i), Doubt::kChance);
  if (parameters.empty()) return false;
  auto [from, to] = parameters.front().ci95;
  double least = 0.0;
  if (const auto term = form.nominal_term()) {
    const NominalTerm& nominal = fit.nominal->terms[*term];
    least = nominal.tolerance;
    from = (from - nominal.value) / nominal.value;
    to = (to - nominal.value) / nominal.value;
    if (from > to) std::swap(from, to);
  }
  return from <= least && to >= -least;
}

ChannelFit fit_of(const ChannelFit& fit, ChannelModel model) {
  ChannelFit out = fit;
  out.model = std::move(model);
  out.coefficients = joint_fit(out.model);
  return out;
}

/// Why a chosen effect has no claim to its name; empty where it has one.
std::string objection(const ChannelFit& fit, std::size_t i,
                      const std::optional<UnnamedShape>& shape, const ChannelOptions& options) {
  if (uncertain(fit, i, options)) return "its interval contains zero";
  const Invariance invariance = invariance_of(fit.model, fit.coefficients, i);
  if (invariance.is_proxy())
    return fmt::format("its size changes with {} (halves differ by {:.0f} %)", invariance.worst,
                       100.0 * invariance.spread);
  if (shape && std::count(shape->says_more_than.begin(), shape->says_more_than.end(), i) > 0)
    return fmt::format("it depends on {} in another way", shape->what.depends_on.front());
  return {};
}

bool supported(const ChannelFit& fit, const ChannelOptions& options) {
  if (fit.model.chosen.empty()) return true;
  const auto shape = likeliest_shape(fit, options);
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i)
    if (!objection(fit, i, shape, options).empty()) return false;
  return true;
}

/// Models that differ by one effect: a rival in the place of an uncertain one, and one more beside
/// those whose size changes with circumstances, which is evidence of it: under the chance gate of a
/// single look, of any size.
std::vector<ChannelModel> neighbours(const ChannelFit& fit, const ChannelOptions& options) {
  std::vector<ChannelModel> out;
  const auto add = [&](const ChannelModel& rest, const Gates& gates, std::string_view stage) {
    const ScreenResult result = screen(rest, gates, derived_seed(options.seed, stage));
    for (const Contender& contender : contenders(rest, result, gates))
      out.push_back(rest.with(contender.tested->best));
  };
  bool proxies = false;
  for (std::size_t i = 0; i < fit.model.chosen.size(); ++i) {
    proxies = proxies || invariance_of(fit.model, fit.coefficients, i).is_proxy();
    if (uncertain(fit, i, options)) add(fit.model.without(i), options.gates, "rivals");
  }
  if (!proxies) return out;
  Gates single_look = options.gates;
  single_look.alpha = std::max(single_look.alpha, kSingleLook);
  single_look.least_z = kOneError;
  single_look.size_per_floor = 0.0;
  add(fit.model, single_look, "companions");
  return out;
}

/// The likeliest of the models that is supported and not clearly less likely than the fit's own.
std::optional<ChannelFit> likeliest_supported(const ChannelFit& fit,
                                              std::vector<ChannelModel> models,
                                              const ChannelOptions& options) {
  const double unit = noise_unit(fit.model);
  const double most = penalised_score(fit.model, unit) + kClearScore;
  sort_by_score(models);
  for (ChannelModel& model : models) {
    if (penalised_score(model, unit) > most) continue;
    ChannelFit trial = fit_of(fit, std::move(model));
    if (supported(trial, options)) return trial;
  }
  return std::nullopt;
}

/// Effects without a claim to their name leave the model, the last first.
void drop_unsupported(ChannelFit& fit, const ChannelOptions& options,
                      std::vector<std::string>& notes) {
  auto shape = likeliest_shape(fit, options);
  for (std::size_t i = fit.model.chosen.size(); i-- > 0;) {
    const std::string why = objection(fit, i, shape, options);
    if (why.empty()) continue;
    const EffectForm& form = *fit.model.candidates[fit.model.chosen[i].candidate]->form;
    notes.push_back(
        fmt::format("something in joint {} ({}) behaves like {}, but {}, so the name is withdrawn",
                    fit.model.series->joint, stage_word(fit.model.series->stage), form.key(), why));
    fit = fit_of(fit, fit.model.without(i));
    shape = likeliest_shape(fit, options);
  }
}

/// The models that differ by more than one effect; those that differ by one are made anew.
void keep_compared(ChannelModel& model, const std::vector<Compared>& others) {
  std::vector<std::size_t> own = model.chosen_candidates();
  std::sort(own.begin(), own.end());
  for (const Compared& other : others) {
    std::vector<std::size_t> theirs = other.candidates, apart;
    std::sort(theirs.begin(), theirs.end());
    std::set_symmetric_difference(own.begin(), own.end(), theirs.begin(), theirs.end(),
                                  std::back_inserter(apart));
    const bool by_one = apart.size() < 2 || (apart.size() == 2 && own.size() == theirs.size());
    if (!by_one || other.steps != !model.steps.empty()) model.compared.push_back(other);
  }
}

}  // namespace

void choose_model(ChannelFit& fit, const physics::Plant& plant, const ChannelOptions& options,
                  std::vector<std::string>& notes) {
  std::vector<ChannelModel> models = reached(fit.model, plant, options);
  std::vector<Compared> others;
  for (const ChannelModel& model : models) others.push_back(as_compared(model));
  fit = fit_of(fit, models.front());
  adopt_common_factor(fit);
  fit.coefficients = joint_fit(fit.model);
  if (!supported(fit, options)) {
    append(models, neighbours(fit, options));
    auto instead = likeliest_supported(fit, std::move(models), options);
    if (instead)
      fit = std::move(*instead);
    else
      drop_unsupported(fit, options, notes);
  }
  keep_compared(fit.model, others);
  for (const auto& [term, column] : fit.model.moved_terms) fit.nominal->terms[term].column = column;
}

}  // namespace ravencal::diagnose
