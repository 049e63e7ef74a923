// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "diagnose/findings/policy.hpp"
#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A column with more of its energy in the means of blocks is slow.
constexpr double kSlowShare = 0.4;

/// What a model's columns leave of a target or of any other signal.
class Fit {
 public:
  Fit(const ChannelModel& model, MatrixXd columns, const VectorXd& target)
      : columns_(std::move(columns)) {
    MatrixXd normal = columns_.transpose() * columns_;
    normal.diagonal() += model.column_precision(columns_.cols());
    normal.diagonal() += 1e-9 * (normal.diagonal().array() + 1e-300).matrix();
    solver_.compute(normal);
    rest_ = rest_of(target);
  }

  [[nodiscard]] const VectorXd& rest() const { return rest_; }
  [[nodiscard]] VectorXd rest_of(const VectorXd& y) const {
    return y - columns_ * solver_.solve(columns_.transpose() * y);
  }

 private:
  MatrixXd columns_;
  Eigen::LDLT<MatrixXd> solver_;
  VectorXd rest_;
};

/// A slow column against noise that wanders: what counts is whether its steps from block to block
/// are seen among the steps of the residual, each an observation of its own.
class Wander {
 public:
  explicit Wander(const ChannelModel& model)
      : model_(model), held_(model, model.columns(), model.target) {
    const auto holds = [](double held) { return held != 0.0; };
    if (std::none_of(model.held.begin(), model.held.end(), holds)) return;
    MatrixXd columns = model.columns();
    columns.leftCols(model.free_base.cols()) = model.free_base;
    free_.emplace(model, std::move(columns), model.free_target);
  }

  /// In (0, 1]; 1 for columns that vary within blocks. A number of the plant that is held at its
  /// limit in an effect's place leaves steps of its own, and one that is free may say what the
  /// effect says: the better view of the two.
  [[nodiscard]] double factor(const MatrixXd& z, const EffectForm& form) const {
    if (model_.blocks.count() < 8 || z.cols() != 1) return 1.0;
    const double held = factor_in(held_, z.col(0), form.time_only());
    if (held == 1.0 || form.nominal_term() || !free_) return held;
    return std::max(held, factor_in(*free_, z.col(0), form.time_only()));
  }

 private:
  [[nodiscard]] double factor_in(const Fit& fit, const VectorXd& z, bool time_only) const {
    const Blocks& blocks = model_.blocks;
    const auto count = static_cast<Index>(blocks.count());
    const VectorXd own = fit.rest_of(z);
    const VectorXd& rest = fit.rest();
    VectorXd x(count);
    VectorXd y(count);
    double slow = 0.0;
    for (Index b = 0; b < count; ++b) {
      const auto n = static_cast<std::size_t>(b);
      x[b] = own.segment(blocks.first(n), blocks.size(n)).mean();
      y[b] = rest.segment(blocks.first(n), blocks.size(n)).mean();
      slow += x[b] * x[b] * static_cast<double>(blocks.size(n));
    }
    if (!time_only && slow < kSlowShare * own.squaredNorm()) return 1.0;
    VectorXd dx = x;
    VectorXd dy = y;
    dx.tail(count - 1) -= x.head(count - 1);
    dy.tail(count - 1) -= y.head(count - 1);
    // A constant takes the level at the start; without one it is a step from nothing.
    if (model_.has_constant()) dx[0] = dy[0] = 0.0;
    const double slope = dx.dot(dy) / std::max(dx.squaredNorm(), 1e-300);
    const double left = (dy - slope * dx).squaredNorm() / static_cast<double>(count - 2);
    const double z2 = slope * slope * dx.squaredNorm() / std::max(left, 1e-300);
    return std::min(1.0, z2 / (kLeastStep_z * kLeastStep_z));
  }

  const ChannelModel& model_;
  Fit held_;
  std::optional<Fit> free_;  ///< where numbers are held
};

/// The model's columns and moments, and what a candidate adds beyond them.
class Screen {
 public:
  explicit Screen(const ChannelModel& model)
      : model_(model),
        columns_(model.columns()),
        precision_(model.column_precision(columns_.cols())),
        moments_(moments_of(model.blocks, columns_, model.target)),
        noise_moments_(moments_of(model.blocks, columns_, model.noise)),
        total_(moments_.total()) {
    const Index k = columns_.cols();
    MatrixXd normal = total_.topLeftCorner(k, k);
    normal.diagonal() += precision_;
    normal.diagonal() += 1e-9 * (normal.diagonal().array() + 1e-300).matrix();
    solver_.compute(normal);
  }

  [[nodiscard]] VectorXd errors() const {
    return held_out_error(model_.blocks, moments_, precision_);
  }

  [[nodiscard]] VectorXd errors_with(const MatrixXd& further) const {
    const Moments all = extended(model_.blocks, moments_, columns_, further, model_.target);
    return held_out_error(model_.blocks, all, model_.column_precision(all.columns()));
  }

  struct Unique {
    MatrixXd projection;  ///< [k x m]: coefficients by which the model imitates the columns
    MatrixXd inverse;     ///< of the unique moments
    double gain = 0.0;
  };

  [[nodiscard]] Unique unique_part(const MatrixXd& z) const {
    const Index k = columns_.cols();
    const MatrixXd cross = columns_.transpose() * z;
    const MatrixXd own = z.transpose() * z;
    Unique u;
    u.projection = solver_.solve(cross);
    MatrixXd m = own - cross.transpose() * u.projection;
    for (Index i = 0; i < m.rows(); ++i) m(i, i) += 1e-7 * own(i, i) + 1e-300;
    u.inverse = m.ldlt().solve(MatrixXd::Identity(m.rows(), m.rows()));
    const VectorXd score =
        z.transpose() * model_.target - u.projection.transpose() * total_.col(k).head(k);
    u.gain = score.dot(u.inverse * score);
    return u;
  }

  [[nodiscard]] FlipOption flip_option(const MatrixXd& z, const Unique& u) const {
    const Blocks& blocks = model_.blocks;
    const Index k = columns_.cols();
    FlipOption option;
    option.inverse = u.inverse;
    option.scores.resize(static_cast<Index>(blocks.count()), z.cols());
    for (std::size_t b = 0; b < blocks.count(); ++b) {
      const auto rows = z.middleRows(blocks.first(b), blocks.size(b));
      const VectorXd score =
          rows.transpose() * model_.noise.segment(blocks.first(b), blocks.size(b)) -
          u.projection.transpose() * noise_moments_.block[b].col(k).head(k);
      option.scores.row(static_cast<Index>(b)) = score.transpose();
    }
    return option;
  }

  /// Contribution's RMS and coefficients in the joint fit.
  [[nodiscard]] std::pair<double, VectorXd> contribution(const MatrixXd& z) const {
    const Moments all = extended(model_.blocks, moments_, columns_, z, model_.target);
    const VectorXd b = solve(all.total(), model_.column_precision(all.columns()));
    const VectorXd own = b.tail(z.cols());
    VectorXd part = z * own;
    part.array() -= part.mean();
    return {std::sqrt(part.squaredNorm() / static_cast<double>(part.size())), own};
  }

 private:
  const ChannelModel& model_;
  MatrixXd columns_;
  VectorXd precision_;
  Moments moments_;
  Moments noise_moments_;
  MatrixXd total_;
  Eigen::LDLT<MatrixXd> solver_;
};

/// RMS that the candidate takes off the held-out error: its contribution beyond what the model can
/// say without it.
double unique_size(const ChannelModel& model, const VectorXd& gains) {
  return std::sqrt(std::max(0.0, gains.sum()) / static_cast<double>(model.target.size()));
}

/// The shape with the fewest columns whose held-out error is within one standard error of the best
/// one's (Breiman et al. 1984): many columns follow the few postures of one recording.
std::size_t simplest_as_good(const FormCandidate& candidate, const std::vector<VectorXd>& errors,
                             std::size_t best) {
  std::size_t simplest = best;
  for (std::size_t s = 0; s < errors.size(); ++s) {
    if (candidate.columns[s].cols() >= candidate.columns[simplest].cols()) continue;
    const VectorXd worse = errors[s] - errors[best];
    const auto count = static_cast<double>(worse.size());
    const double mean = worse.mean();
    const double variance = (worse.array() - mean).square().sum() / std::max(1.0, count - 1.0);
    if (mean <= std::sqrt(variance / count)) simplest = s;
  }
  return simplest;
}

/// Variance of a sum of block scores over what independent blocks would give: noise slower than a
/// block makes neighbouring scores agree, and flipping their signs one by one overlooks that
/// (Newey and West, Econometrica 1987, Bartlett weights; never below 1).
double slow_noise_inflation(const MatrixXd& scores) {
  const Index count = scores.rows();
  const Index lags = std::min<Index>(count / 5, 6);
  const double power = scores.squaredNorm();
  double inflation = 1.0;
  for (Index lag = 1; lag <= lags; ++lag) {
    double product = 0.0;
    for (Index b = 0; b + lag < count; ++b) product += scores.row(b).dot(scores.row(b + lag));
    const double weight = 1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1);
    inflation += 2.0 * weight * product / std::max(power, 1e-300);
  }
  return std::max(1.0, inflation);
}

}  // namespace

double z_score(const VectorXd& gains) {
  const auto count = static_cast<double>(gains.size());
  const double mean = gains.mean();
  const double variance = (gains.array() - mean).square().sum() / std::max(1.0, count - 1.0);
  return variance > 0.0 ? mean / std::sqrt(variance / count) : 0.0;
}

ScreenResult screen(const ChannelModel& model, const Gates& gates, std::uint64_t seed) {
  const Screen view(model);
  const Wander wander(model);
  ScreenResult result;
  result.errors = view.errors();
  std::vector<FlipCandidate> flips;
  double best_gain = 0.0;
  for (std::size_t c = 0; c < model.candidates.size(); ++c) {
    const FormCandidate& candidate = *model.candidates[c];
    if (!model.offers(c)) continue;
    TestedCandidate tested;
    tested.candidate = c;
    FlipCandidate flip;
    double least_error = 0.0;
    double least_rank = 0.0;
    const bool sized_by_coefficient = candidate.form->unit_coefficient(*model.series);
    std::vector<VectorXd> shape_errors;
    for (std::size_t s = 0; s < candidate.shapes.size(); ++s) {
      const VectorXd errors = view.errors_with(candidate.columns[s]);
      const auto unique = view.unique_part(candidate.columns[s]);
      flip.options.push_back(view.flip_option(candidate.columns[s], unique));
      shape_errors.push_back(errors);
      // A replayed effect counts at the size that its own coefficient asks for.
      double rank = errors.sum();
      if (sized_by_coefficient) {
        const double b = view.contribution(candidate.columns[s]).second[0];
        rank = b > 0.0 ? std::abs(std::log(b)) : 1e6 + rank;
      }
      if (s == 0 || rank < least_rank) {
        least_rank = rank;
        least_error = errors.sum();
        flip.found_option = s;
        tested.best = {c, candidate.shapes[s], candidate.columns[s]};
        tested.errors = errors;
      }
    }
    const std::size_t simplest = simplest_as_good(candidate, shape_errors, flip.found_option);
    if (simplest != flip.found_option) {
      flip.found_option = simplest;
      tested.best = {c, candidate.shapes[simplest], candidate.columns[simplest]};
      tested.errors = shape_errors[simplest];
    }
    best_gain = std::max(best_gain, result.errors.sum() - least_error);
    flips.push_back(std::move(flip));
    result.tested.push_back(std::move(tested));
  }
  for (std::size_t n = 0; n < result.tested.size(); ++n) {
    TestedCandidate& tested = result.tested[n];
    const EffectForm& form = *model.candidates[tested.candidate]->form;
    const double gain = result.errors.sum() - tested.errors.sum();
    const double least_share = form.unit_coefficient(*model.series) ? 0.1 : 0.3;
    if ((form.continuous() || least_share < 0.3) && gain > least_share * best_gain &&
        best_gain > 0.0) {
      tested.best = refined(model, tested.best);
      tested.errors = view.errors_with(tested.best.columns);
    }
    const auto unique = view.unique_part(tested.best.columns);
    tested.inflation = slow_noise_inflation(flips[n].options[flips[n].found_option].scores);
    flips[n].gain = unique.gain / tested.inflation * wander.factor(tested.best.columns, form);
    const VectorXd gains = result.errors - tested.errors;
    const auto [size, coefficients] = view.contribution(tested.best.columns);
    tested.coefficients = coefficients;
    tested.consistent = form.inconsistency(*model.series, tested.best.shape, coefficients).empty();
    if (const auto term = form.nominal_term())
      tested.consistent = tested.consistent && coefficients[0] * model.held[*term] > 0.0;
    tested.evidence = {model.rms_of(result.errors),
                       model.rms_of(tested.errors),
                       z_score(gains),
                       sign_flip_p(gains, seed, 999),
                       1.0,
                       gains.sum() / std::max(result.errors.sum(), 1e-300),
                       std::min(size, unique_size(model, gains))};
  }
  const FlipResult chance = sign_flip_test(flips, gates.alpha, seed);
  // That anything is there is what chance is asked about. What it is is then a matter of
  // likelihood, and a number of the plant, which the others at their limits imitate in part, may
  // take its place.
  double anything = 1.0;
  for (const double p_value : chance.p_value) anything = std::min(anything, p_value);
  for (std::size_t n = 0; n < result.tested.size(); ++n) {
    TestedCandidate& tested = result.tested[n];
    const EffectForm& form = *model.candidates[tested.candidate]->form;
    const bool number = form.nominal_term() || form.off_by(tested.coefficients);
    tested.evidence.p_value = number ? anything : chance.p_value[n];
    tested.median_null = chance.median_null[n];
    tested.critical_gain = chance.critical_gain[n];
  }
  return result;
}

namespace {

/// Moves the size of a replayed effect to where its coefficient is one. Numbers of the plant that
/// stood in for it at their limits are free to come back.
Chosen sized(const ChannelModel& model, const Chosen& start) {
  const EffectForm& form = *model.candidates[start.candidate]->form;
  Chosen best = start;
  for (int i = 0; i < 5; ++i) {
    const VectorXd all = joint_fit(model.with(best));
    const double b = all[all.size() - 1];
    if (b <= 0.0 || std::abs(b - 1.0) < 0.01) break;
    best.shape[0] *= std::clamp(b, 0.2, 5.0);
    best.columns = model.blocks.gather(seen_columns(form, *model.series, best.shape));
  }
  return best;
}

}  // namespace

Chosen refined(const ChannelModel& model, const Chosen& start) {
  const EffectForm& form = *model.candidates[start.candidate]->form;
  if (form.unit_coefficient(*model.series)) return sized(model, start);
  if (!form.continuous() || start.shape.empty()) return start;
  const Screen view(model);
  const auto evaluate = [&](double log_value) {
    Chosen trial{start.candidate, {std::exp(log_value)}, {}};
    trial.columns = model.blocks.gather(seen_columns(form, *model.series, trial.shape));
    return std::pair{view.errors_with(trial.columns).sum(), trial};
  };
  const std::vector<Shape>& grid = model.candidates[start.candidate]->shapes;
  const double step = grid.size() > 1 ? std::abs(std::log(grid[1][0] / grid[0][0])) : 0.5;
  // Golden section over one grid step to either side.
  constexpr double kGolden = 0.6180339887498949;
  double low = std::max(std::log(start.shape[0]) - step, std::log(grid.front()[0]));
  double high = std::min(std::log(start.shape[0]) + step, std::log(grid.back()[0]));
  if (high <= low) return start;
  auto left = evaluate(high - kGolden * (high - low));
  auto right = evaluate(low + kGolden * (high - low));
  for (int i = 0; i < 9; ++i) {
    if (left.first < right.first) {
      high = low + kGolden * (high - low);
      right = std::move(left);
      left = evaluate(high - kGolden * (high - low));
    } else {
      low = high - kGolden * (high - low);
      left = std::move(right);
      right = evaluate(low + kGolden * (high - low));
    }
  }
  auto& best = left.first < right.first ? left : right;
  return best.first < view.errors_with(start.columns).sum() ? best.second : start;
}

}  // namespace ravencal::diagnose
