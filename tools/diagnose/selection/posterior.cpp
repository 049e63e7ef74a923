// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/posterior.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/standard_normal.hpp"
#include "diagnose/selection/with_steps.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kDraws = 400;

/// True if the richer columns can say what the effect's part says.
bool contains(const ChannelModel& model, const Chosen& richer, const Chosen& own,
              const VectorXd& part) {
  if (freedom_of(model, richer) <= freedom_of(model, own)) return false;
  const MatrixXd& z = richer.columns;
  const MatrixXd ridge = 1e-12 * MatrixXd::Identity(z.cols(), z.cols());
  const VectorXd left = part - z * (z.transpose() * z + ridge).ldlt().solve(z.transpose() * part);
  return left.squaredNorm() < kContained * part.squaredNorm();
}

/// Weights of the models, mean over draws of the blocks' weights.
VectorXd weights_of(const std::vector<Alternative>& models, double unit, std::uint64_t seed) {
  const auto count = static_cast<Index>(models.size());
  const Index blocks = models.front().errors.size();
  MatrixXd errors(count, blocks);
  VectorXd cost(count), form(count);
  for (Index k = 0; k < count; ++k) {
    errors.row(k) = models[static_cast<std::size_t>(k)].errors.transpose() / unit;
    cost[k] = models[static_cast<std::size_t>(k)].cost;
    form[k] = models[static_cast<std::size_t>(k)].form_error / unit;
  }
  std::mt19937_64 engine(seed);
  VectorXd weights = VectorXd::Zero(count);
  VectorXd share(blocks);
  for (int d = 0; d < kDraws; ++d) {
    // Dirichlet(1, ..., 1) from exponentials.
    for (double& x : share) x = -std::log(0x1p-53 * (static_cast<double>(engine() >> 11U) + 0.5));
    share *= static_cast<double>(blocks) / share.sum();
    VectorXd score = errors * share + cost;
    for (Index k = 0; k < count; ++k)
      if (form[k] > 0.0) score[k] += form[k] * standard_normal(engine);
    const VectorXd likely = (-0.5 * (score.array() - score.minCoeff())).exp();
    weights += likely / likely.sum();
  }
  return weights / kDraws;
}

/// All that may stand beside `rest`, but for ids that `skip` takes out.
template <typename Skip>
void add_rivals(const ChannelModel& rest, const Gates& gates, std::uint64_t seed, Skip&& skip,
                std::vector<Alternative>& out) {
  for (const TestedCandidate& t : screen(rest, gates, seed).tested) {
    if (skip(t)) continue;
    const ChannelModel with = rest.with(t.best);
    if (last_is_consistent(with))
      out.push_back(alternative_of(with, rest.candidates[t.candidate]->form->id()));
  }
}

/// The models that the search preferred this one to, each with what stands in the place of `id`:
/// itself where `holds` finds it there, what the chosen model lacks, or nothing.
template <typename Holds>
void add_compared(const ChannelModel& model, const std::string& id, Holds&& holds,
                  std::vector<Alternative>& out) {
  const std::vector<std::size_t> own = model.chosen_candidates();
  for (const Compared& other : model.compared) {
    std::string in_place;
    if (holds(other)) {
      in_place = id;
    } else {
      if (other.steps && model.steps.empty()) in_place = slip_kind().id();
      for (const std::size_t one : other.candidates)
        if (!is_among(own, one)) in_place = model.candidates[one]->form->id();
    }
    out.push_back({std::move(in_place), other.errors, other.cost, other.form_error});
  }
}

}  // namespace

Alternative alternative_of(const ChannelModel& model, std::string id) {
  Compared own = as_compared(model);
  return {std::move(id), std::move(own.errors), own.cost};
}

std::vector<std::string> EffectPosterior::credible_others(double mass) const {
  std::vector<std::string> ids;
  double held = in_place;
  for (const InPlace& other : others) {
    if (held >= mass) break;
    ids.push_back(other.id);
    held += other.probability;
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

EffectPosterior weigh(const std::vector<Alternative>& alternatives,
                      const std::vector<std::string>& same, double unit, std::uint64_t seed) {
  const VectorXd weights = weights_of(alternatives, unit, seed);
  std::map<std::string, double> by_id;
  double own = 0.0, something = 0.0;
  for (std::size_t k = 0; k < alternatives.size(); ++k) {
    const double weight = weights[static_cast<Index>(k)];
    if (alternatives[k].id.empty()) continue;
    something += weight;
    (alternatives[k].id == alternatives.front().id ? own : by_id[alternatives[k].id]) += weight;
  }
  const double each = own / static_cast<double>(1 + same.size());
  for (const std::string& id : same) by_id[id] += each;
  EffectPosterior out;
  out.probability = each;
  out.in_place = something > 0.0 ? each / something : 0.0;
  for (const auto& [id, weight] : by_id) out.others.push_back({id, weight / something});
  std::stable_sort(out.others.begin(), out.others.end(), [](const InPlace& a, const InPlace& b) {
    return a.probability > b.probability;
  });
  return out;
}

EffectPosterior posterior_of(const ChannelModel& model, const VectorXd& coefficients,
                             std::size_t chosen, const Gates& gates, std::uint64_t seed) {
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  const std::vector<std::string> same = form.look_alikes(*model.series);
  std::vector<Alternative> all = {alternative_of(model, form.id())};
  const auto holds = [&own](const Compared& other) {
    return is_among(other.candidates, own.candidate);
  };
  add_compared(model, form.id(), holds, all);
  if (own.everywhere.size() > 0 && all.size() > 1) {
    // One by one the cable's effects hide each other.
    all.front().form_error = all[1].form_error;
  } else {
    const ChannelModel rest = model.without(chosen);
    all.push_back(alternative_of(rest, ""));
    const VectorXd part =
        own.columns * coefficients.segment(model.first_column(chosen), own.columns.cols());
    const auto skip = [&](const TestedCandidate& t) {
      const std::string& id = model.candidates[t.candidate]->form->id();
      return id == form.id() || std::find(same.begin(), same.end(), id) != same.end() ||
             contains(model, t.best, own, part);
    };
    add_rivals(rest, gates, seed, skip, all);
  }
  return weigh(all, same, noise_unit(model), seed);
}

EffectPosterior posterior_of_step(const ChannelModel& model, std::size_t step,
                                  const std::string& id, const std::vector<std::string>& same,
                                  std::uint64_t seed) {
  std::vector<Alternative> all = {alternative_of(model, id),
                                  alternative_of(without_step(model, step), "")};
  const auto holds = [](const Compared& other) { return other.steps; };
  add_compared(model, id, holds, all);
  return weigh(all, same, noise_unit(model), seed);
}

EffectPosterior posterior_of_constant(const ChannelModel& model, const EffectForm& form,
                                      const Gates& gates, std::uint64_t seed) {
  const ChannelModel bare = without_constant(model);
  std::vector<Alternative> all = {alternative_of(model, form.id()), alternative_of(bare, "")};
  add_rivals(
      bare, gates, seed, [](const TestedCandidate&) { return false; }, all);
  return weigh(all, form.look_alikes(*model.series), noise_unit(model), seed);
}

double probability_at(double p_value) {
  const double p = std::max(p_value, 1e-300);
  // The bound on the Bayes factor holds below 1/e; above, nothing speaks for an effect.
  const double for_chance = p < std::exp(-1.0) ? -std::exp(1.0) * p * std::log(p) : 1.0;
  return 1.0 / (1.0 + for_chance * std::exp(0.5 * effect_cost(1)));
}

}  // namespace ravencal::diagnose
