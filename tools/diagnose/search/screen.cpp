// SPDX-License-Identifier: Apache-2.0
#include "diagnose/search/screen.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "core/side_by_side.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kFlips = 300;
/// Sizes beyond so many of their starts are no effect.
constexpr double kAbsurd = 1e6;
constexpr double kRidge = 1e-4;

/// The linearised model, with what every candidate's test needs.
class Screen {
 public:
  Screen(const Likelihood& likelihood, const Model& model)
      : likelihood_(likelihood), at_(linearise(likelihood, model)), free_(model.free()) {
    const auto count = static_cast<Index>(free_.size());
    unbound_ = at_.columns;
    pull_.resize(count);
    for (Index k = 0; k < count; ++k) {
      const Parameter& p = *free_[static_cast<std::size_t>(k)];
      pull_[k] = prior_of(p) * (p.x - p.mean);
      if (!p.at_bound()) continue;
      // A parameter at its bound makes nothing of a candidate.
      at_.columns.col(k).setZero();
      at_.curvature.row(k).setZero();
      at_.curvature.col(k).setZero();
      at_.curvature(k, k) = 1.0;
    }
    inverse_ = at_.curvature.ldlt().solve(MatrixXd::Identity(count, count));
    weighted_ = at_.root_weights.asDiagonal() * at_.columns;
    left_ = at_.root_weights.cwiseProduct(at_.innovations);
  }

  /// What the score says of one start of a candidate.
  struct Test {
    Hit hit;
    bool fits = false;       ///< its sizes are within their bounds
    MatrixXd scores;         ///< by block, each column in deviations; none where no chance applies
    double curvature = 0.0;  ///< of the loss over the first size, the model's own part apart
    double whole = 0.0;      ///< the same with that part
  };

  [[nodiscard]] Test test(const Candidate& candidate, std::size_t number, std::size_t start) const {
    const auto count = static_cast<Index>(candidate.sizes.size());
    MatrixXd columns = columns_of(candidate, start);
    if (candidate.is_presence()) return test_whole(candidate, number, start, columns.col(0));
    columns = at_.root_weights.asDiagonal() * columns;
    Test out;
    out.hit.candidate = number;
    out.hit.start = start;
    out.whole = columns.col(0).squaredNorm();
    const MatrixXd taken = inverse_ * (weighted_.transpose() * columns);
    columns.noalias() -= weighted_ * taken;
    MatrixXd curvature = columns.transpose() * columns;
    for (Index a = 0; a < count; ++a) {
      curvature(a, a) += kRidge;
      for (std::size_t k = 0; k < free_.size(); ++k)
        curvature(a, a) += prior_of(*free_[k]) * std::pow(taken(static_cast<Index>(k), a), 2);
    }
    out.curvature = curvature(0, 0);
    // What the priors hold back belongs to the score.
    const VectorXd held_back = taken.transpose() * pull_;
    const VectorXd score = columns.transpose() * left_ + held_back;
    VectorXd& sizes = out.hit.sizes = curvature.ldlt().solve(score);
    for (Index a = 0; a < count; ++a) {
      const Parameter& p = candidate.sizes[static_cast<std::size_t>(a)];
      if (sizes[a] < p.low || !(std::abs(sizes[a]) < kAbsurd)) return out;
      sizes[a] = std::min(sizes[a], p.high);
    }
    out.hit.gain = std::max(0.0, 2.0 * score.dot(sizes) - sizes.dot(curvature * sizes));
    MatrixXd scores = block_scores(columns, held_back);
    MatrixXd covariance = scores.transpose() * scores;
    covariance.diagonal() *= 1.0 + 1e-6;
    const MatrixXd root = covariance.llt().matrixL().solve(MatrixXd::Identity(count, count));
    out.fits = root.allFinite();
    if (!out.fits) return out;
    scores = scores * root.transpose();
    out.hit.statistic = statistic_of(VectorXd::Ones(scores.rows()), scores);
    if (!candidate.searched()) out.scores = std::move(scores);
    return out;
  }

  /// What holds or does not: rows that it makes outliers say nothing to first order, so that the
  /// whole of it is tried.
  [[nodiscard]] Test test_whole(const Candidate& candidate, std::size_t number, std::size_t start,
                                const VectorXd& column) const {
    const double x = candidate.sizes.front().high;
    Test out;
    out.hit.candidate = number;
    out.hit.start = start;
    out.hit.sizes.setConstant(1, x);
    out.curvature = out.whole = 1.0;
    MatrixXd gains = MatrixXd::Zero(likelihood_.block_count(), 1);
    for (Index i = 0; i < column.size(); ++i)
      gains(likelihood_.blocks()[static_cast<std::size_t>(i)], 0) +=
          huber_loss(at_.innovations[i]) - huber_loss(at_.innovations[i] - x * column[i]);
    out.hit.gain = gains.sum();
    out.fits = out.hit.gain > 0.0;
    if (!out.fits) return out;
    out.scores = gains / gains.norm();
    out.hit.statistic = statistic_of(VectorXd::Ones(gains.rows()), out.scores);
    return out;
  }

  /// How well the rows alone know a number; its own share is what its prior does not say.
  [[nodiscard]] Resolution resolution_of_number(const Candidate& candidate, std::size_t number,
                                                const Model& model) const {
    Resolution out{number, 0, 0.0, 0.0};
    const Parameter* wanted = &model.numbers[*candidate.opens];
    for (std::size_t k = 0; k < free_.size(); ++k) {
      if (free_[k] != wanted || wanted->at_bound()) continue;
      const double prior = prior_of(*wanted);
      const auto i = static_cast<Index>(k);
      const double rows = 1.0 / inverse_(i, i) - prior;
      if (rows > 0.0) out.deviation = std::sqrt(likelihood_.dispersion() / rows);
      out.own = std::max(0.0, 1.0 - prior * inverse_(i, i));
    }
    return out;
  }

  void add(Test test) {
    if (!test.fits) return;
    hits_.push_back(std::move(test.hit));
    scores_.push_back(std::move(test.scores));
  }

  /// A number of the model whose prior opens: the score of leaving the place where that prior holds
  /// it, the model's other parameters apart.
  [[nodiscard]] Test test_number(const Candidate& candidate, std::size_t number,
                                 const Model& model) const {
    Test out;
    out.hit.candidate = number;
    const Parameter* wanted = &model.numbers[*candidate.opens];
    const auto at = std::find(free_.begin(), free_.end(), wanted);
    if (at == free_.end()) return out;
    const auto k = static_cast<Index>(at - free_.begin());
    MatrixXd column = at_.root_weights.asDiagonal() * unbound_.col(k);
    // Of the others alone.
    VectorXd taken = inverse_ * (weighted_.transpose() * column.col(0));
    taken -= inverse_.col(k) * (taken[k] / inverse_(k, k));
    taken[k] = 0.0;
    column.col(0).noalias() -= weighted_ * taken;
    const double closed = prior_of(*wanted), opened = prior_of(candidate.opened);
    double curvature = column.squaredNorm() + opened;
    for (std::size_t i = 0; i < free_.size(); ++i)
      curvature += prior_of(*free_[i]) * std::pow(taken[static_cast<Index>(i)], 2);
    const double off = wanted->x - wanted->mean;
    const VectorXd held_back = VectorXd::Constant(1, taken.dot(pull_) - opened * off);
    const double score = column.col(0).dot(left_) + held_back[0];
    out.hit.gain = score * score / curvature + (closed - opened) * off * off;
    out.scores = block_scores(column, held_back);
    const double norm = out.scores.norm();
    out.fits = norm > 0.0 && score * off >= 0.0;
    if (!out.fits) return out;
    out.scores /= norm;
    out.hit.statistic = statistic_of(VectorXd::Ones(out.scores.rows()), out.scores);
    return out;
  }

  void judge_chance(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<double> greatest;
    VectorXd signs(likelihood_.block_count());
    for (int flip = 0; flip < kFlips; ++flip) {
      for (double& sign : signs) sign = (random() & 1U) != 0 ? 1.0 : -1.0;
      double most = 0.0;
      for (const MatrixXd& scores : scores_)
        if (scores.size() > 0) most = std::max(most, statistic_of(signs, scores));
      greatest.push_back(most);
    }
    std::sort(greatest.begin(), greatest.end());
    for (std::size_t h = 0; h < hits_.size(); ++h) {
      if (scores_[h].size() == 0) continue;
      const auto above =
          greatest.end() - std::lower_bound(greatest.begin(), greatest.end(), hits_[h].statistic);
      hits_[h].p_value = (static_cast<double>(above) + 1.0) / (kFlips + 1.0);
    }
  }

  /// The best start of each candidate, with the least chance of any of its starts.
  [[nodiscard]] std::vector<Hit> best() const {
    std::map<std::size_t, Hit> of;
    for (const Hit& hit : hits_) {
      const auto [at, is_new] = of.try_emplace(hit.candidate, hit);
      if (is_new) continue;
      const double p_value = std::min(at->second.p_value, hit.p_value);
      if (hit.gain > at->second.gain) at->second = hit;
      at->second.p_value = p_value;
    }
    std::vector<Hit> out;
    for (auto& [candidate, hit] : of) out.push_back(hit);
    std::stable_sort(out.begin(), out.end(),
                     [](const Hit& a, const Hit& b) { return a.gain > b.gain; });
    return out;
  }

 private:
  /// Curvature of a prior in units of the loss.
  [[nodiscard]] double prior_of(const Parameter& p) const {
    return likelihood_.dispersion() / (p.deviation * p.deviation);
  }

  [[nodiscard]] MatrixXd columns_of(const Candidate& candidate, std::size_t start) const {
    State state = at_.state;
    for (std::size_t f = 0; f < candidate.forms.size(); ++f)
      candidate.forms[f].set(state, candidate.starts[start][f]);
    for (const Parameter& size : candidate.sizes) size.set(state, size.nominal);
    MatrixXd columns(likelihood_.rows(), static_cast<Index>(candidate.sizes.size()));
    for (std::size_t a = 0; a < candidate.sizes.size(); ++a)
      likelihood_.add_column(state, at_.outcome, candidate.sizes[a], candidate.sizes[a].step,
                             columns.col(static_cast<Index>(a)));
    return columns;
  }

  [[nodiscard]] MatrixXd block_scores(const MatrixXd& columns, const VectorXd& held_back) const {
    MatrixXd scores = MatrixXd::Zero(likelihood_.block_count(), columns.cols());
    for (Index i = 0; i < columns.rows(); ++i)
      if (left_[i] != 0.0)
        scores.row(likelihood_.blocks()[static_cast<std::size_t>(i)]) += left_[i] * columns.row(i);
    scores.rowwise() += held_back.transpose() / static_cast<double>(likelihood_.block_count());
    return scores;
  }

  /// Less the second degree of freedom of a pair, so that pairs and single sizes compare.
  static double statistic_of(const VectorXd& signs, const MatrixXd& scores) {
    const double squared = (scores.transpose() * signs).squaredNorm();
    return std::max(0.0, squared - static_cast<double>(scores.cols() - 1));
  }

  const Likelihood& likelihood_;
  Linearised at_;
  std::vector<const Parameter*> free_;
  VectorXd pull_, left_;
  MatrixXd inverse_, weighted_;
  MatrixXd unbound_;  ///< columns of all parameters, those at their bounds as well
  std::vector<Hit> hits_;
  std::vector<MatrixXd> scores_;  ///< of each hit, by block, each column in deviations
};

struct Start {
  std::size_t candidate = 0;
  std::size_t number = 0;
};

/// Every start of what has sizes and is not in the model, by candidates.
std::vector<Start> starts_of(const Model& model, const Vocabulary& vocabulary,
                             std::optional<std::size_t> joint) {
  std::vector<Start> out;
  for (std::size_t c = 0; c < vocabulary.candidates.size(); ++c) {
    const Candidate& candidate = vocabulary.candidates[c];
    if (model.chosen.contains(c) || candidate.opens) continue;
    if (!vocabulary.may_stand(c, model.chosen)) continue;
    if (joint && candidate.joint != *joint) continue;
    for (std::size_t s = 0; s < candidate.start_count(); ++s) out.push_back({c, s});
  }
  return out;
}

std::vector<Screen::Test> tests_of(const Screen& screen, const std::vector<Start>& starts,
                                   const Vocabulary& vocabulary, unsigned threads) {
  std::vector<Screen::Test> tests(starts.size());
  core::for_each_index(starts.size(), threads, [&](std::size_t i) {
    const Start& start = starts[i];
    tests[i] = screen.test(vocabulary.candidates[start.candidate], start.candidate, start.number);
  });
  return tests;
}

}  // namespace

std::vector<Hit> screen(const Likelihood& likelihood, const Model& model,
                        const Vocabulary& vocabulary, std::uint64_t seed,
                        std::optional<std::size_t> joint) {
  Screen screen(likelihood, model);
  const std::vector<Start> starts = starts_of(model, vocabulary, joint);
  for (Screen::Test& test : tests_of(screen, starts, vocabulary, likelihood.threads()))
    screen.add(std::move(test));
  for (std::size_t c = 0; c < vocabulary.candidates.size(); ++c) {
    const Candidate& candidate = vocabulary.candidates[c];
    const bool wanted = !joint || candidate.joint == *joint;
    if (wanted && candidate.opens && !model.chosen.contains(c))
      screen.add(screen.test_number(candidate, c, model));
  }
  screen.judge_chance(seed);
  return screen.best();
}

std::vector<Hit> screen_one(const Likelihood& likelihood, const Model& model,
                            const Candidate& candidate) {
  Screen screen(likelihood, model);
  for (std::size_t start = 0; start < candidate.start_count(); ++start)
    screen.add(screen.test(candidate, 0, start));
  return screen.best();
}

std::vector<Resolution> resolutions(const Likelihood& likelihood, const Model& model,
                                    const Vocabulary& vocabulary) {
  const Screen screen(likelihood, model);
  std::vector<Start> starts = starts_of(model, vocabulary, {});
  // Where a wave that was searched for is missing, none was found.
  std::erase_if(starts, [&](const Start& start) {
    const auto& stated = vocabulary.candidates[start.candidate].stated_orders;
    return stated && start.number >= *stated;
  });
  std::vector<Resolution> out;
  for (const Screen::Test& test : tests_of(screen, starts, vocabulary, likelihood.threads())) {
    const Resolution r{test.hit.candidate, test.hit.start,
                       std::sqrt(likelihood.dispersion() / test.curvature),
                       test.whole > 0.0 ? test.curvature / test.whole : 0.0};
    const bool same = !out.empty() && out.back().candidate == r.candidate;
    if (!same)
      out.push_back(r);
    else if (r.deviation > out.back().deviation)
      out.back() = r;
  }
  for (std::size_t c = 0; c < vocabulary.candidates.size(); ++c) {
    const Candidate& candidate = vocabulary.candidates[c];
    if (candidate.opens && !model.chosen.contains(c))
      out.push_back(screen.resolution_of_number(candidate, c, model));
  }
  return out;
}

Model with(const Model& model, const Vocabulary& vocabulary, const Hit& hit) {
  constexpr double kStepShare = 0.05;
  const Candidate& candidate = vocabulary.candidates[hit.candidate];
  Model out = model;
  out.judgement = {};
  out.chosen.insert(hit.candidate);
  std::vector<Parameter>& parameters = out.effects[hit.candidate];
  if (candidate.opens) {
    Parameter& number = out.numbers[*candidate.opens];
    const double x = candidate.opened.bounded(number.x);
    number = candidate.opened;
    number.x = x;
    return out;
  }
  for (std::size_t a = 0; a < candidate.sizes.size(); ++a) {
    Parameter p = candidate.sizes[a];
    p.x = p.bounded(hit.sizes[static_cast<Index>(a)]);
    p.step = std::max(0.02, kStepShare * std::abs(p.x));
    parameters.push_back(std::move(p));
  }
  for (std::size_t f = 0; f < candidate.forms.size(); ++f) {
    Parameter p = candidate.forms[f];
    const double start = candidate.starts[hit.start][f];
    if (!p.logarithmic)
      p.x = p.mean = start;
    else if (p.nominal == 0.0)
      p.nominal = start;
    else
      p.x = p.mean = std::log(start / p.nominal);
    parameters.push_back(std::move(p));
  }
  return out;
}

Model without(const Model& model, const Vocabulary& vocabulary, std::size_t chosen) {
  const Candidate& candidate = vocabulary.candidates[chosen];
  Model out = model;
  out.judgement = {};
  out.chosen.erase(chosen);
  out.effects.erase(chosen);
  if (candidate.opens) {
    Parameter& number = out.numbers[*candidate.opens];
    const double x = number.x;
    number = vocabulary.numbers[*candidate.opens];
    number.x = number.bounded(x);
  }
  for (const std::size_t other : model.chosen)
    if (out.chosen.contains(other) && !vocabulary.may_stand(other, out.chosen))
      out = without(out, vocabulary, other);
  return out;
}

}  // namespace ravencal::diagnose
