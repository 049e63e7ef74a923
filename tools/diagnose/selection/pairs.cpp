// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/pairs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnose/findings/policy.hpp"
#include "diagnose/selection/contenders.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Pairs whose company the plant's numbers are held in anew.
constexpr std::size_t kShortList = 5;
/// A replayed effect counts at the size that its own coefficient asks for; sizes of its grid lie
/// this far apart.
constexpr double kMostMissized = 2.5;

/// One candidate with one of its shapes.
struct Option {
  std::size_t candidate = 0, shape = 0;
  Index first = 0, count = 0;  ///< its columns among all options'
};

struct Pair {
  const Option* first = nullptr;
  const Option* second = nullptr;
  double score = 0.0;
};

/// Held-out errors of the model with any two options, from moments that are made once.
class Pairs {
 public:
  Pairs(const ChannelModel& model, const std::vector<std::size_t>& dropped)
      : model_(model), base_(model.columns()) {
    for (std::size_t c = 0; c < model.candidates.size(); ++c) {
      if (!model.offers(c) || is_among(dropped, c)) continue;
      for (std::size_t s = 0; s < model.candidates[c]->columns.size(); ++s) {
        const Index count = model.candidates[c]->columns[s].cols();
        options_.push_back({c, s, width_, count});
        width_ += count;
      }
    }
    folds_.fold.resize(kFolds);
    std::iota(folds_.fold.begin(), folds_.fold.end(), 0);
    moments_.block.assign(kFolds,
                          MatrixXd::Zero(base_.cols() + width_ + 1, base_.cols() + width_ + 1));
    for (std::size_t b = 0; b < model.blocks.count(); ++b) add_block(b);
    for (MatrixXd& m : moments_.block) m.triangularView<Eigen::StrictlyUpper>() = m.transpose();
  }

  /// The likeliest consistent ones, each with its likeliest shapes, best first.
  [[nodiscard]] std::vector<Pair> likeliest() const {
    const double unit = noise_unit(model_);
    std::vector<Pair> best;
    for (const Option& a : options_) {
      for (const Option& b : options_) {
        if (a.candidate >= b.candidate) continue;
        const Moments own = moments_with(a, b);
        const VectorXd precision = model_.column_precision(own.columns());
        const double score = held_out_error(folds_, own, precision).sum() / unit;
        if (best.size() == kShortList && score > best.back().score) continue;
        if (!consistent(a, b, solve(own.total(), precision))) continue;
        enter(best, {&a, &b, score});
      }
    }
    return best;
  }

  [[nodiscard]] Chosen chosen(const Option& option) const {
    const FormCandidate& candidate = *model_.candidates[option.candidate];
    return {option.candidate, candidate.shapes[option.shape], candidate.columns[option.shape]};
  }

 private:
  static void enter(std::vector<Pair>& best, const Pair& pair) {
    const auto same = std::find_if(best.begin(), best.end(), [&](const Pair& other) {
      return other.first->candidate == pair.first->candidate &&
             other.second->candidate == pair.second->candidate;
    });
    if (same == best.end())
      best.push_back(pair);
    else if (pair.score < same->score)
      *same = pair;
    std::sort(best.begin(), best.end(),
              [](const Pair& x, const Pair& y) { return x.score < y.score; });
    if (best.size() > kShortList) best.pop_back();
  }

  void add_block(std::size_t block) {
    const Index at = model_.blocks.first(block), size = model_.blocks.size(block);
    MatrixXd joined(size, base_.cols() + width_ + 1);
    joined.leftCols(base_.cols()) = base_.middleRows(at, size);
    for (const Option& o : options_)
      joined.middleCols(base_.cols() + o.first, o.count) =
          model_.candidates[o.candidate]->columns[o.shape].middleRows(at, size);
    joined.rightCols(1) = model_.target.segment(at, size);
    moments_.block[static_cast<std::size_t>(model_.blocks.fold[block])]
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(joined.transpose());
  }

  [[nodiscard]] Moments moments_with(const Option& a, const Option& b) const {
    std::vector<Index> at(static_cast<std::size_t>(base_.cols()));
    std::iota(at.begin(), at.end(), 0);
    for (const Option* o : {&a, &b})
      for (Index i = 0; i < o->count; ++i) at.push_back(base_.cols() + o->first + i);
    at.push_back(base_.cols() + width_);
    Moments out;
    for (const MatrixXd& m : moments_.block) out.block.emplace_back(m(at, at));
    return out;
  }

  [[nodiscard]] bool consistent(const Option& a, const Option& b, const VectorXd& all) const {
    Index at = base_.cols();
    for (const Option* o : {&a, &b}) {
      const FormCandidate& candidate = *model_.candidates[o->candidate];
      const VectorXd own = all.segment(at, o->count);
      at += o->count;
      const auto term = candidate.form->nominal_term();
      if (term && own[0] * model_.held[*term] <= 0.0) return false;
      if (candidate.form->unit_coefficient(*model_.series) &&
          (own[0] < 1.0 / kMostMissized || own[0] > kMostMissized))
        return false;
      if (!candidate.form->inconsistency(*model_.series, candidate.shapes[o->shape], own).empty())
        return false;
    }
    return true;
  }

  const ChannelModel& model_;
  MatrixXd base_;
  std::vector<Option> options_;
  Index width_ = 0;
  Blocks folds_;     ///< one block per fold: enough for held-out errors
  Moments moments_;  ///< of base, all options and target
};

/// The pair that is likeliest once the plant's numbers are held anew in its company.
std::vector<Chosen> likeliest_pair(const ChannelModel& model,
                                   const std::vector<std::size_t>& dropped) {
  const Pairs pairs(model, dropped);
  std::vector<Chosen> best;
  double least = penalised_score(model) - kUncalledScore;
  for (const Pair& pair : pairs.likeliest()) {
    std::vector<Chosen> both = {pairs.chosen(*pair.first), pairs.chosen(*pair.second)};
    const double score = penalised_score(model.with(both[0]).with(both[1]));
    if (score >= least) continue;
    least = score;
    best = std::move(both);
  }
  return best;
}

}  // namespace

std::vector<Chosen> pick_pair(const ChannelModel& model, const std::vector<std::size_t>& dropped,
                              const Gates& gates, std::uint64_t seed) {
  for (const Chosen& first : likeliest_pair(model, dropped)) {
    ChannelModel one = model.with(first);
    one.noise = saturated_noise(one);
    ScreenResult beside = screen(one, gates, seed);
    std::erase_if(beside.tested, [&](const TestedCandidate& tested) {
      return is_among(dropped, tested.candidate);
    });
    if (const auto second = pick(beside, one, gates)) return {first, second->tested->best};
  }
  return {};
}

}  // namespace ravencal::diagnose
