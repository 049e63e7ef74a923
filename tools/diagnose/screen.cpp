// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/selection.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The model's columns and moments, and what a candidate adds beyond them.
class Screen {
 public:
  Screen(const ChannelModel& model, std::size_t without)
      : model_(model),
        columns_(model.columns(without)),
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
    double energy = 0.0;
    double share = 0.0;
    double gain = 0.0;
  };

  [[nodiscard]] Unique unique_part(const MatrixXd& z) const {
    const Index k = columns_.cols();
    const MatrixXd cross = columns_.transpose() * z;
    const MatrixXd own = z.transpose() * z;
    Unique u;
    u.projection = solver_.solve(cross);
    MatrixXd m = own - cross.transpose() * u.projection;
    u.energy = m(0, 0);
    double total_energy = 0.0;
    double unique_energy = 0.0;
    for (Index i = 0; i < m.rows(); ++i) {
      total_energy += own(i, i);
      unique_energy += std::max(0.0, m(i, i));
    }
    u.share = total_energy > 0.0 ? unique_energy / total_energy : 0.0;
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

double z_score(const VectorXd& gains) {
  const auto count = static_cast<double>(gains.size());
  const double mean = gains.mean();
  const double variance = (gains.array() - mean).square().sum() / std::max(1.0, count - 1.0);
  return variance > 0.0 ? mean / std::sqrt(variance / count) : 0.0;
}

/// Lag-one correlation of the noise's block means: time-only columns see slow noise as signal.
double slow_noise_factor(const ChannelModel& model) {
  const Blocks& blocks = model.blocks;
  double product = 0.0;
  double power = 0.0;
  double last = 0.0;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const double mean = model.noise.segment(blocks.first(b), blocks.size(b)).mean();
    if (b > 0) product += last * mean;
    power += mean * mean;
    last = mean;
  }
  const double rho = power > 0.0 ? std::clamp(product / power, 0.0, 0.95) : 0.0;
  return (1.0 - rho) / (1.0 + rho);
}

}  // namespace

ScreenResult screen(const ChannelModel& model, const Gates& gates, std::uint64_t seed,
                    std::size_t without) {
  const Screen view(model, without);
  ScreenResult result;
  result.errors = view.errors();
  std::vector<FlipCandidate> flips;
  const double slow = slow_noise_factor(model);
  double best_gain = 0.0;
  for (std::size_t c = 0; c < model.candidates.size(); ++c) {
    const Candidate& candidate = model.candidates[c];
    const bool in_model =
        std::any_of(model.chosen.begin(), model.chosen.end(), [&](const Chosen& chosen) {
          return chosen.candidate == c &&
                 (without == SIZE_MAX || &chosen != &model.chosen[without]);
        });
    if (!candidate.untestable.empty() || in_model) continue;
    if (!model.permits(*candidate.form, without)) continue;
    TestedCandidate tested;
    tested.candidate = c;
    FlipCandidate flip;
    double least_error = 0.0;
    for (std::size_t s = 0; s < candidate.shapes.size(); ++s) {
      const VectorXd errors = view.errors_with(candidate.columns[s]);
      const auto unique = view.unique_part(candidate.columns[s]);
      flip.options.push_back(view.flip_option(candidate.columns[s], unique));
      if (s == 0 || errors.sum() < least_error) {
        least_error = errors.sum();
        flip.found_option = s;
        tested.best = {c, candidate.shapes[s], candidate.columns[s]};
        tested.errors = errors;
      }
    }
    best_gain = std::max(best_gain, result.errors.sum() - least_error);
    flips.push_back(std::move(flip));
    result.tested.push_back(std::move(tested));
  }
  for (std::size_t n = 0; n < result.tested.size(); ++n) {
    TestedCandidate& tested = result.tested[n];
    const EffectForm& form = *model.candidates[tested.candidate].form;
    if (form.continuous() && result.errors.sum() - tested.errors.sum() > 0.3 * best_gain &&
        best_gain > 0.0) {
      tested.best = refined(model, tested.best, without);
      tested.errors = view.errors_with(tested.best.columns);
    }
    const auto unique = view.unique_part(tested.best.columns);
    tested.unique_energy = unique.energy;
    tested.unique_share = unique.share;
    flips[n].gain = unique.gain * (form.id() == "thermal_drift" ? slow : 1.0);
    const VectorXd gains = result.errors - tested.errors;
    const auto [size, coefficients] = view.contribution(tested.best.columns);
    tested.consistent = form.inconsistency(*model.series, tested.best.shape, coefficients).empty();
    tested.evidence = {model.rms_of(result.errors),
                       model.rms_of(tested.errors),
                       z_score(gains),
                       sign_flip_p(gains, seed, 999),
                       1.0,
                       gains.sum() / std::max(result.errors.sum(), 1e-300),
                       size};
  }
  const FlipResult chance = sign_flip_test(flips, gates.alpha, seed);
  result.critical = chance.critical;
  for (std::size_t n = 0; n < result.tested.size(); ++n) {
    result.tested[n].evidence.p_value = chance.p_value[n];
    result.tested[n].median_null = chance.median_null[n];
  }
  return result;
}

Chosen refined(const ChannelModel& model, const Chosen& start, std::size_t without) {
  const EffectForm& form = *model.candidates[start.candidate].form;
  if (!form.continuous() || start.shape.empty()) return start;
  const Screen view(model, without);
  const auto evaluate = [&](double log_value) {
    Chosen trial{start.candidate, {std::exp(log_value)}, {}};
    trial.columns = model.blocks.gather(seen_columns(form, *model.series, trial.shape));
    return std::pair{view.errors_with(trial.columns).sum(), trial};
  };
  const std::vector<Shape>& grid = model.candidates[start.candidate].shapes;
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
