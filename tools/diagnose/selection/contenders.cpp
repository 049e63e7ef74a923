// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/contenders.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/selection/beyond.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool admissible(const Evidence& e, const ChannelModel& model, const Gates& gates) {
  return e.p_value <= gates.alpha && e.share >= gates.least_share &&
         e.size >= gates.size_per_floor * model.floor;
}

}  // namespace

Evidence anew(Evidence e, const VectorXd& before, const VectorXd& after, double rows,
              std::uint64_t seed) {
  const VectorXd gains = before - after;
  const double gain = gains.sum();
  e.held_out_before = std::sqrt(before.sum() / rows);
  e.held_out_after = std::sqrt(after.sum() / rows);
  e.z = z_score(gains);
  e.block_p = sign_flip_p(gains, seed, 999);
  e.share = gain / std::max(before.sum(), 1e-300);
  e.size = std::sqrt(std::max(0.0, gain) / rows);
  return e;
}

bool takes_most(const EffectForm& form, const VectorXd& before, const VectorXd& after,
                const Gates& gates) {
  const VectorXd gains = before - after;
  // Of time alone neighbours tell each other, however far they are.
  if (form.time_only() || gains.sum() < gates.most_share * before.sum()) return false;
  Index best = 0;
  gains.maxCoeff(&best);
  const Index first = std::max<Index>(best - 1, 0);
  const Index count = std::min<Index>(best + 2, gains.size()) - first;
  const double gain = gains.sum() - gains.segment(first, count).sum();
  return gain >= gates.most_share * (before.sum() - before.segment(first, count).sum());
}

bool last_is_consistent(const ChannelModel& model) {
  const Chosen& last = model.chosen.back();
  const EffectForm& form = *model.candidates[last.candidate]->form;
  const VectorXd b = joint_fit(model).tail(last.columns.cols());
  if (const auto term = form.nominal_term(); term && std::abs(b[0]) <= model.limit[*term])
    return false;
  return form.inconsistency(*model.series, last.shape, b).empty();
}

std::vector<Contender> contenders(const ChannelModel& model, const ScreenResult& result,
                                  const Gates& gates) {
  const double unit = noise_unit(model);
  std::vector<Contender> out;
  const auto rows = static_cast<double>(std::max<Index>(1, model.target.size()));
  for (const TestedCandidate& tested : result.tested) {
    if (tested.evidence.p_value > gates.alpha) continue;
    const ChannelModel with = model.with(tested.best);
    Contender contender{&tested, held_out_errors(with), 0.0};
    const Evidence e = anew(tested.evidence, result.errors, contender.errors, rows, 1);
    const EffectForm& form = *model.candidates[tested.candidate]->form;
    const bool repeated =
        repeats(gates, e.z, e.block_p) || takes_most(form, result.errors, contender.errors, gates);
    if (!repeated || !admissible(e, model, gates) || !last_is_consistent(with)) continue;
    if (form.takes_any_shape(*model.series) && !predicts_beyond(with, model)) continue;
    contender.score = contender.errors.sum() / unit + prior_cost(with, joint_fit(with));
    out.push_back(std::move(contender));
  }
  return out;
}

std::optional<Contender> pick(const ScreenResult& result, const ChannelModel& model,
                              const Gates& gates) {
  const std::vector<Contender> all = contenders(model, result, gates);
  const auto best =
      std::min_element(all.begin(), all.end(),
                       [](const Contender& a, const Contender& b) { return a.score < b.score; });
  return best == all.end() ? std::nullopt : std::optional(*best);
}

}  // namespace ravencal::diagnose
