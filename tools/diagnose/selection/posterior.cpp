// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/posterior.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kDraws = 400;
/// A richer form that leaves less than this share of an effect's part is that effect with more
/// freedom, and no rival.
constexpr double kContained = 0.05;

/// A model in the neighbourhood.
struct Neighbour {
  const EffectForm* form = nullptr;  ///< in the effect's place; null: nothing
  VectorXd errors;                   ///< held-out squared error by block
  double cost = 0.0;                 ///< twice the negative log of the prior
};

Neighbour neighbour_of(const ChannelModel& model, const EffectForm* form) {
  const VectorXd b = joint_fit(model);
  double cost = nominal_cost(model, b);
  for (std::size_t i = 0; i < model.chosen.size(); ++i) cost += chosen_cost(model, i, b);
  return {form, held_out_errors(model), cost};
}

/// True if the richer columns can say what the effect's part says.
bool contains(const ChannelModel& model, const Chosen& richer, const Chosen& own,
              const VectorXd& part) {
  if (freedom_of(model, richer) <= freedom_of(model, own)) return false;
  const MatrixXd& z = richer.columns;
  const MatrixXd ridge = 1e-12 * MatrixXd::Identity(z.cols(), z.cols());
  const VectorXd left = part - z * (z.transpose() * z + ridge).ldlt().solve(z.transpose() * part);
  return left.squaredNorm() < kContained * part.squaredNorm();
}

std::vector<Neighbour> neighbours_of(const ChannelModel& model, const VectorXd& coefficients,
                                     std::size_t chosen, const Gates& gates, std::uint64_t seed) {
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  const ChannelModel rest = model.without(chosen);
  const VectorXd part =
      own.columns * coefficients.segment(model.first_column(chosen), own.columns.cols());
  std::vector<Neighbour> out = {neighbour_of(model, &form), neighbour_of(rest, nullptr)};
  for (const TestedCandidate& t : screen(rest, gates, seed).tested) {
    const EffectForm& other = *model.candidates[t.candidate]->form;
    if (t.candidate == own.candidate || other.id() == form.id()) continue;
    if (contains(model, t.best, own, part)) continue;
    const ChannelModel with = rest.with(t.best);
    if (last_is_consistent(with)) out.push_back(neighbour_of(with, &other));
  }
  return out;
}

/// Weights of the models, mean over draws of the blocks' weights.
VectorXd weights_of(const std::vector<Neighbour>& models, double unit, std::uint64_t seed) {
  const auto count = static_cast<Index>(models.size());
  const Index blocks = models.front().errors.size();
  MatrixXd errors(count, blocks);
  VectorXd cost(count);
  for (Index k = 0; k < count; ++k) {
    errors.row(k) = models[static_cast<std::size_t>(k)].errors.transpose() / unit;
    cost[k] = models[static_cast<std::size_t>(k)].cost;
  }
  std::mt19937_64 engine(seed);
  VectorXd weights = VectorXd::Zero(count);
  VectorXd share(blocks);
  for (int d = 0; d < kDraws; ++d) {
    // Dirichlet(1, ..., 1) from exponentials.
    for (double& x : share) x = -std::log(0x1p-53 * (static_cast<double>(engine() >> 11U) + 0.5));
    share *= static_cast<double>(blocks) / share.sum();
    const VectorXd score = errors * share + cost;
    const VectorXd likely = (-0.5 * (score.array() - score.minCoeff())).exp();
    weights += likely / likely.sum();
  }
  return weights / kDraws;
}

}  // namespace

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

EffectPosterior posterior_of(const ChannelModel& model, const VectorXd& coefficients,
                             std::size_t chosen, const Gates& gates, std::uint64_t seed) {
  const EffectForm& form = *model.candidates[model.chosen[chosen].candidate]->form;
  const auto models = neighbours_of(model, coefficients, chosen, gates, seed);
  const VectorXd weights = weights_of(models, noise_unit(model), seed);
  // No statistic parts an effect from those that make the same columns: they share its weight.
  std::map<std::string, double> by_id;
  const std::vector<std::string> same = form.twins(*model.series);
  const double each = weights[0] / static_cast<double>(1 + same.size());
  for (const std::string& id : same) by_id[id] += each;
  double something = weights[0];
  for (std::size_t k = 2; k < models.size(); ++k) {
    by_id[models[k].form->id()] += weights[static_cast<Index>(k)];
    something += weights[static_cast<Index>(k)];
  }
  EffectPosterior out;
  out.probability = each;
  out.in_place = something > 0.0 ? each / something : 0.0;
  for (const auto& [id, weight] : by_id) out.others.push_back({id, weight / something});
  std::stable_sort(out.others.begin(), out.others.end(), [](const InPlace& a, const InPlace& b) {
    return a.probability > b.probability;
  });
  return out;
}

}  // namespace ravencal::diagnose
