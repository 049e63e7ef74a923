// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/search.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/cable_family.hpp"
#include "diagnose/selection/contenders.hpp"
#include "diagnose/selection/pairs.hpp"

namespace ravencal::diagnose {
namespace {

constexpr std::size_t kMostEffects = 7;
/// First effects from which climbs begin.
constexpr std::size_t kBeginnings = 3;

/// A model on its way, and the candidates that it dropped: they do not come back, since the climb
/// must end.
struct Climb {
  ChannelModel model;
  std::vector<std::size_t> dropped;
};

void refine_all(ChannelModel& model) {
  model.hold_nominal();
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < model.chosen.size(); ++i)
      model.chosen[i] = refined(model.without(i), model.chosen[i]);
  }
}

/// Drops effects that the others made superfluous.
void drop_superfluous(ChannelModel& model, const Gates& gates, std::uint64_t seed) {
  for (std::size_t i = model.chosen.size(); i-- > 0;) {
    const EffectForm& form = *model.candidates[model.chosen[i].candidate]->form;
    const Evidence e = evidence_of(model, i, gates, seed);
    if (model.permits(form) && e.p_value <= gates.alpha && e.share >= gates.least_share &&
        (repeats(gates, e.z, e.block_p) ||
         takes_most(form, held_out_errors(model.without(i)), held_out_errors(model), gates)))
      continue;
    model.chosen.erase(model.chosen.begin() + static_cast<std::ptrdiff_t>(i));
    model.hold_nominal();
  }
}

/// What may join the model, likeliest first: one effect, or a pair where no single one is admitted.
std::vector<std::vector<Chosen>> additions(Climb& climb, const Gates& gates, std::uint64_t seed) {
  ChannelModel& model = climb.model;
  model.take_noise(saturated_noise(model));
  const auto round = model.chosen.size();
  ScreenResult result = screen(model, gates, derived_seed(seed, "search", round));
  std::erase_if(result.tested, [&](const TestedCandidate& tested) {
    return is_among(climb.dropped, tested.candidate);
  });
  std::vector<Contender> next = contenders(model, result, gates);
  std::stable_sort(next.begin(), next.end(),
                   [](const Contender& a, const Contender& b) { return a.score < b.score; });
  std::vector<std::vector<Chosen>> out;
  for (const Contender& contender : next) out.push_back({contender.tested->best});
  if (!out.empty()) return out;
  auto pair = pick_pair(model, climb.dropped, gates, derived_seed(seed, "pairs", round));
  if (!pair.empty()) out.push_back(std::move(pair));
  return out;
}

/// The model with `found` in it, and without what that makes superfluous.
void join(Climb& climb, const std::vector<Chosen>& found, const Gates& gates, std::uint64_t seed) {
  ChannelModel& model = climb.model;
  const std::vector<Chosen> alone = model.chosen;
  model.chosen.insert(model.chosen.end(), found.begin(), found.end());
  refine_all(model);
  // What two effects hid from each other passed for noise.
  if (found.size() > 1) model.noise = saturated_noise(model);
  const std::vector<std::size_t> before = model.chosen_candidates();
  drop_superfluous(model, gates, seed);
  // Of two that entered together, one says nothing without the other.
  if (found.size() > 1 && model.chosen.size() < before.size()) {
    model.chosen = alone;
    model.hold_nominal();
  }
  const std::vector<std::size_t> kept = model.chosen_candidates();
  for (const std::size_t candidate : before)
    if (!is_among(kept, candidate)) climb.dropped.push_back(candidate);
}

/// The model at the end of a climb, the cable's effects fitted together.
ChannelModel settled(ChannelModel model, const Gates& gates, std::uint64_t seed) {
  settle_cable(model, gates);
  model.noise = saturated_noise(model);
  drop_superfluous(model, gates, seed);
  model.take_noise(saturated_noise(model));
  return model;
}

/// From a beginning to where nothing more is admitted.
ChannelModel climbed(Climb climb, const std::vector<Chosen>& beginning, const Gates& gates,
                     std::uint64_t seed) {
  join(climb, beginning, gates, seed);
  while (climb.model.chosen.size() < kMostEffects) {
    const auto next = additions(climb, gates, seed);
    if (next.empty()) break;
    join(climb, next.front(), gates, seed);
  }
  return settled(std::move(climb.model), gates, seed);
}

/// True if the model leaves more than a search among some hundred would gain by chance.
bool leaves_error(const ChannelModel& model) {
  return held_out_errors(model).sum() - model.noise.squaredNorm() >
         kUncalledScore * noise_unit(model);
}

}  // namespace

void sort_by_score(std::vector<ChannelModel>& models) {
  if (models.size() < 2) return;
  double unit = std::numeric_limits<double>::infinity();
  for (const ChannelModel& model : models) unit = std::min(unit, noise_unit(model));
  std::vector<double> score;
  for (const ChannelModel& model : models) score.push_back(penalised_score(model, unit));
  std::vector<std::size_t> order(models.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return score[a] < score[b]; });
  std::vector<ChannelModel> sorted;
  for (const std::size_t n : order) sorted.push_back(std::move(models[n]));
  models = std::move(sorted);
}

std::vector<ChannelModel> search_effects(const ChannelModel& start, const Gates& gates,
                                         std::uint64_t seed) {
  Climb root{start, {}};
  const auto beginnings = additions(root, gates, seed);
  std::vector<ChannelModel> models;
  for (std::size_t n = 0; n < std::min(kBeginnings, beginnings.size()); ++n) {
    if (n > 0 && !leaves_error(models.front())) break;
    models.push_back(climbed(root, beginnings[n], gates, seed));
  }
  if (models.empty()) models.push_back(settled(std::move(root.model), gates, seed));
  sort_by_score(models);
  return models;
}

void select_effects(ChannelModel& model, const Gates& gates, std::uint64_t seed) {
  model = std::move(search_effects(model, gates, seed).front());
}

}  // namespace ravencal::diagnose
