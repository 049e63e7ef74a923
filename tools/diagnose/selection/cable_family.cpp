// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/cable_family.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/effects/shapes.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/selection/cable_fit.hpp"
#include "diagnose/selection/cable_members.hpp"
#include "diagnose/selection/invariance.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t kMostMembers = 3;
/// Sets whose whole fit is worth a look at held-out blocks.
constexpr std::size_t kFamilyShortList = 7;

struct Judged {
  CableSubset subset;
  ChannelModel model;
  VectorXd errors;
  double score = 0.0;
};

double cost_of(const CableSubset& subset, const ChannelModel& model) {
  double cost = 0.0;
  for (std::size_t m = 0; m < subset.members.size(); ++m) {
    const CableMember& member = *subset.members[m];
    if (!member.is_number()) {
      // Where creep begins, how strands were left and whether their loops close: no physics of
      // its own.
      cost += effect_cost(std::min<Index>(2, subset.log_values[m].size())) +
              missing_cost(*model.candidates[member.candidate]->form, *model.series);
      continue;
    }
    const auto term = model.candidates[member.candidate]->form->nominal_term();
    cost += number_cost(std::expm1(subset.log_values[m][0]), model.tolerance[*term]);
  }
  return cost;
}

/// Sets of up to three members: physics that the plant lacks, or numbers that are off. A number far
/// off beside missing physics of the same cable cannot be told from how that physics is simulated.
std::vector<std::vector<const CableMember*>> sets_of(const std::vector<CableMember>& members) {
  std::vector<std::vector<const CableMember*>> sets;
  const std::size_t count = members.size();
  for (std::size_t mask = 1; mask < (std::size_t{1} << count); ++mask) {
    std::vector<const CableMember*> set;
    for (std::size_t m = 0; m < count; ++m)
      if ((mask >> m & 1U) != 0) set.push_back(&members[m]);
    const auto numbers =
        std::count_if(set.begin(), set.end(), [](const CableMember* m) { return m->is_number(); });
    const bool one_kind = numbers == 0 || numbers == static_cast<std::ptrdiff_t>(set.size());
    if (one_kind && set.size() <= kMostMembers) sets.push_back(std::move(set));
  }
  return sets;
}

/// The model with that set in it; nothing where a number contradicts its effect.
std::optional<Judged> judged(const ChannelModel& rest, CableSubset subset, double unit) {
  Judged out{std::move(subset), rest, {}, 0.0};
  move_nominal(out.model, cable_with(*rest.series, out.subset));
  out.subset = CableFit(out.model).improved(std::move(out.subset));
  for (Chosen& chosen : chosen_of(rest, out.subset)) out.model.chosen.push_back(std::move(chosen));
  out.model.hold_nominal();
  const VectorXd b = joint_fit(out.model);
  Index at = out.model.base.cols();
  for (const Chosen& chosen : out.model.chosen) {
    const EffectForm& form = *rest.candidates[chosen.candidate]->form;
    const VectorXd own = b.segment(at, chosen.columns.cols());
    at += chosen.columns.cols();
    if (chosen.everywhere.size() == 0) continue;
    if (!form.inconsistency(*rest.series, chosen.shape, own).empty()) return std::nullopt;
    const auto term = form.nominal_term();
    if (term && std::abs(own[0]) < rest.limit[*term]) return std::nullopt;
  }
  out.errors = held_out_errors(out.model);
  out.score = out.errors.sum() / unit + cost_of(out.subset, out.model) + nominal_cost(out.model, b);
  return out;
}

std::vector<Judged> short_list(const ChannelModel& rest, const std::vector<CableMember>& members,
                               double unit) {
  const CableFit fit(rest);
  std::vector<std::pair<double, CableSubset>> fitted;
  const auto rows = static_cast<double>(rest.target.size());
  for (const auto& set : sets_of(members)) {
    CableSubset subset = fit.fit(set);
    const double score = subset.error * rows / unit + cost_of(subset, rest);
    fitted.emplace_back(score, std::move(subset));
  }
  std::sort(fitted.begin(), fitted.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Judged> list;
  for (auto& [score, subset] : fitted) {
    if (list.size() >= kFamilyShortList) break;
    if (auto one = judged(rest, std::move(subset), unit)) list.push_back(std::move(*one));
  }
  return list;
}

bool steady(const ChannelModel& model) {
  const VectorXd b = joint_fit(model);
  for (std::size_t i = 0; i < model.chosen.size(); ++i) {
    if (model.chosen[i].everywhere.size() > 0 && invariance_of(model, b, i).is_proxy())
      return false;
  }
  return true;
}

/// Error that no simulation of a cable comes below, as sum of squares: a share of how far the cable
/// parts motor and joint, and of strands half of what laws of friction differ by.
double form_error(const ChannelModel& rest, const CableSubset& subset) {
  const Series& s = *rest.series;
  CableNumbers cable = cable_with(s, subset);
  VectorXd stretch = rest.blocks.gather(cable_stretch(s, cable));
  stretch.array() -= stretch.mean();
  double squares = kModelForm * kModelForm * stretch.squaredNorm();
  if (cable.strand_stiffness <= 0.0) return squares;
  cable.strand_openness = 0.0;
  VectorXd law = rest.blocks.gather(cable_stretch(s, cable));
  cable.strand_openness = 1.0;
  law -= rest.blocks.gather(cable_stretch(s, cable));
  law.array() -= law.mean();
  return squares + 0.25 * law.squaredNorm();
}

/// The likeliest set; a smaller one where held-out blocks do not tell the two apart, or differ by
/// less than simulations of cables do; sets whose sizes change with circumstances only where no
/// other is as good.
const Judged* best_of(const std::vector<Judged>& list, const ChannelModel& rest) {
  const auto first = std::min_element(
      list.begin(), list.end(), [](const Judged& a, const Judged& b) { return a.score < b.score; });
  if (first == list.end()) return nullptr;
  const double form = form_error(rest, first->subset);
  const auto as_good = [&](const Judged& other) {
    if (other.errors.sum() - first->errors.sum() < form) return true;
    return other.score < first->score + kUncalledScore && tied(other.errors, first->errors);
  };
  const Judged* best = &*first;
  bool best_steady = steady(best->model);
  for (const Judged& other : list) {
    const std::size_t size = other.subset.members.size();
    const std::size_t least = best->subset.members.size();
    const bool likelier = best != &*first && other.score < best->score;
    const bool smaller = size < least || (size == least && likelier);
    const bool steadier = !best_steady && size <= least;
    if (&other == best || !as_good(other) || !(smaller || steadier)) continue;
    if (!steady(other.model)) continue;
    best = &other;
    best_steady = true;
  }
  return best;
}

/// The sets that were not chosen, each as a whole model.
std::vector<Compared> others_of(const std::vector<Judged>& list, const Judged& best, double unit,
                                double form_error) {
  std::vector<Compared> out;
  const double chosen_cost = prior_cost(best.model, joint_fit(best.model));
  for (const Judged& other : list) {
    if (&other == &best) continue;
    Compared one = as_compared(other.model);
    // Of what every set has, the cost of the one chosen; of the set itself, its numbers'.
    one.cost = chosen_cost + (other.score - other.errors.sum() / unit) -
               (best.score - best.errors.sum() / unit);
    one.form_error = form_error;
    out.push_back(std::move(one));
  }
  return out;
}

/// What the selection, which takes effects one by one, says of the cable.
struct Called {
  ChannelModel rest;  ///< the model without it
  double cost = 0.0;
  double form_error = 0.0;  ///< as of a set, were it named; none where nothing of the cable is
  bool strands = false, other_physics = false;

  explicit Called(const ChannelModel& model) : rest(model) {
    std::erase_if(rest.chosen, [&](const Chosen& c) {
      return cable_kind(*model.candidates[c.candidate]->form, *model.series).has_value();
    });
    if (rest.chosen.size() == model.chosen.size()) return;
    rest.hold_nominal();
    const VectorXd b = joint_fit(model);
    const Series& s = *model.series;
    VectorXd stretch = model.blocks.gather(cable_stretch(s, s.cable));
    for (std::size_t i = 0; i < model.chosen.size(); ++i) {
      const Chosen& c = model.chosen[i];
      const EffectForm& form = *model.candidates[c.candidate]->form;
      const auto kind = cable_kind(form, s);
      if (!kind) continue;
      const VectorXd own = b.segment(model.first_column(i), c.columns.cols());
      stretch -= c.columns * own;
      const bool number = form.nominal_term().has_value();
      strands = strands || *kind == CableMember::Kind::kStrands;
      other_physics = other_physics || (!number && *kind != CableMember::Kind::kStrands);
      cost += chosen_cost(model, i, b);
    }
    stretch.array() -= stretch.mean();
    form_error = kModelForm * kModelForm * stretch.squaredNorm();
  }
};

/// Puts the set in place that the selection, which takes effects one by one, could not come to.
/// Where it named one of the cable's effects, what a set explains beyond it must exceed what
/// simulations of that one differ by; and strands, whose loops take any shape, are added to no
/// other name: LuGre friction beside a gap passes for them.
void settle_beside(ChannelModel& model, const Gates& gates) {
  const VectorXd errors = held_out_errors(model);
  const double unit = noise_unit(model);
  const Called called(model);
  // Nothing is there to gain where the error is the noise; but where a set was taken for one of its
  // members, what that one leaves passes for noise.
  const double noise = called.form_error > 0.0 ? called.form_error : model.noise.squaredNorm();
  if (errors.sum() - noise < kUncalledScore * unit) return;
  const double excess = called.rest.rms_of(held_out_errors(called.rest));
  std::vector<CableMember> members = cable_members(called.rest, excess);
  if (called.other_physics && !called.strands)
    std::erase_if(members,
                  [](const CableMember& m) { return m.kind == CableMember::Kind::kStrands; });
  if (members.empty()) return;
  const std::vector<Judged> list = short_list(called.rest, members, unit);
  const Judged* best = best_of(list, called.rest);
  if (best == nullptr) return;
  const double present = errors.sum() / unit + nominal_cost(model, joint_fit(model)) + called.cost;
  if (best->score > present - kUncalledScore) return;
  const double gain = errors.sum() - best->errors.sum();
  if (gain < std::max(called.form_error, gates.least_share * errors.sum())) return;
  ChannelModel settled = best->model;
  settled.compared = others_of(list, *best, unit, form_error(called.rest, best->subset));
  model = std::move(settled);
}

}  // namespace

void settle_cable(ChannelModel& model, const Gates& gates) {
  // What creep leaves from an unknown start looks like a drift: the sets are tried without one
  // first, and with it where they do not explain as much.
  ChannelModel timeless = model;
  std::erase_if(timeless.chosen, [&](const Chosen& chosen) {
    return model.candidates[chosen.candidate]->form->time_only();
  });
  if (timeless.chosen.size() < model.chosen.size()) {
    timeless.hold_nominal();
    const VectorXd present = held_out_errors(model);
    settle_beside(timeless, gates);
    const bool instead = std::any_of(timeless.chosen.begin(), timeless.chosen.end(),
                                     [](const Chosen& c) { return c.everywhere.size() > 0; });
    const VectorXd errors = held_out_errors(timeless);
    if (instead && (errors.sum() < present.sum() || tied(errors, present))) {
      model = std::move(timeless);
      return;
    }
  }
  settle_beside(model, gates);
}

}  // namespace ravencal::diagnose
