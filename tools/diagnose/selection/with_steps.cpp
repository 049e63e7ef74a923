// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/with_steps.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/findings/policy.hpp"
#include "diagnose/fit/derived_seed.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void append_step(ChannelModel& model, const Step& step) {
  model.steps.push_back(step);
  model.base.conservativeResize(Eigen::NoChange, model.base.cols() + 1);
  model.base.rightCols(1) = model.blocks.gather(step_column(*model.series, step));
  model.free_base.conservativeResize(Eigen::NoChange, model.base.cols());
  model.free_base.rightCols(1) = model.base.rightCols(1);
  model.precision.conservativeResize(model.precision.size() + 1);
  model.precision[model.precision.size() - 1] = 0.0;
}

/// Where a step takes most off the error of the plant with its tolerances; share of that error.
std::pair<Step, double> likeliest_step(const ChannelModel& model) {
  constexpr Index kPlaces = 160;
  const MatrixXd normal = model.free_base.transpose() * model.free_base;
  MatrixXd weighted = normal;
  weighted.diagonal() += model.precision;
  weighted.diagonal() += 1e-9 * normal.diagonal();
  const Eigen::LDLT<MatrixXd> solver(weighted);
  const VectorXd b = solver.solve(model.free_base.transpose() * model.free_target);
  const VectorXd rest = model.free_target - model.free_base * b;
  std::pair<Step, double> best;
  const auto consider = [&](Index n) {
    Step step;
    step.row = model.blocks.rows[static_cast<std::size_t>(n)];
    const VectorXd z = model.blocks.gather(step_column(*model.series, step)).col(0);
    const VectorXd cross = model.free_base.transpose() * z;
    const double unique = z.squaredNorm() - cross.dot(solver.solve(cross));
    if (unique < 1e-6 * z.squaredNorm()) return;
    const double score = z.dot(rest);
    const double share = score * score / unique / std::max(rest.squaredNorm(), 1e-300);
    if (share <= best.second) return;
    step.t_s = model.series->t_s[step.row];
    step.size = score / unique;
    best = {step, share};
  };
  const Index count = rest.size();
  const Index stride = std::max<Index>(1, count / kPlaces);
  for (Index n = 4 * stride; n + 4 * stride < count; n += stride) consider(n);
  return best;
}

/// Row from which on a step takes most off what everything else leaves, a constant aside.
Index likeliest_row(const ChannelModel& model, const VectorXd& left) {
  const Index count = left.size();
  const Index least = std::max<Index>(1, count / 40);
  const double mean = left.mean();
  double sum = left.head(least - 1).sum() - mean * static_cast<double>(least - 1);
  double most = 0.0;
  Index at = least;
  for (Index n = least; n + least < count; ++n) {
    sum += left[n - 1] - mean;
    const double gain = sum * sum / (static_cast<double>(n) * static_cast<double>(count - n));
    if (gain > most) {
      most = gain;
      at = n;
    }
  }
  return model.blocks.rows[static_cast<std::size_t>(at)];
}

/// A large step bends everything that is fitted beside it, so that none of it is left to be seen,
/// and what is not fitted yet bends the place where it seems to be. The likeliest one is taken into
/// the model, which gives honest noise, and put back onto that noise to say where it is, in turns.
/// Where it comes to rest it must take a quarter of what passed for noise, or it would hide
/// nothing; whether it is real is asked by the score of the whole model. From one start to the next
/// homing may have changed, which bends as much and is no step.
void append_hidden_step(ChannelModel& model) {
  constexpr int kTurns = 6;
  if (stretches_of(*model.series, model.blocks.rows).size() > 1) return;
  auto [suspect, share] = likeliest_step(model);
  if (share < kHidingShare) return;
  const Index near = std::max<Index>(4, model.target.size() / 1000);
  for (int turn = 0; turn < kTurns; ++turn) {
    ChannelModel trial = model;
    append_step(trial, suspect);
    trial.hold_nominal();
    const VectorXd noise = saturated_noise(trial);
    const VectorXd coefficients = joint_fit(trial);
    suspect.size = coefficients[coefficients.size() - 1];
    const VectorXd column = trial.base.rightCols(1);
    const Index row = likeliest_row(model, noise + suspect.size * column);
    if (std::abs(row - suspect.row) <= near) {
      const double memory = noise_memory(trial, noise);
      const auto rows = static_cast<double>(noise.size());
      const double variance = noise.squaredNorm() / rows;
      if (noise.squaredNorm() > kMostLeftOfHidden * model.noise.squaredNorm()) return;
      const double energy = (column.array() - column.mean()).square().sum();
      suspect.window = near;
      suspect.deviation = std::sqrt(variance * memory / energy);
      suspect.p_value =
          chance_anywhere(std::abs(suspect.size) / suspect.deviation, 0.5 * rows / memory);
      append_step(model, suspect);
      model.hold_nominal();
      model.noise = noise;
      model.correlation_rows = memory;
      model.floor = std::sqrt(variance);
      return;
    }
    suspect.row = row;
    suspect.t_s = model.series->t_s[row];
  }
}

/// True if the step says clearly more than a constant of the whole stretch that it is in: homing
/// may have changed from one start to the next.
bool is_within_its_stretch(const ChannelModel& model, std::size_t step) {
  const Series& s = *model.series;
  Step whole = model.steps[step];
  while (whole.row > 0 && s.fresh[static_cast<std::size_t>(whole.row)] == 0) --whole.row;
  const VectorXd column = model.blocks.gather(step_column(s, whole)).col(0);
  if (same_column(column, VectorXd::Ones(column.size()))) return true;
  ChannelModel other = model;
  const Index at = model.step_at(step);
  other.base.col(at) = column;
  other.free_base.col(at) = column;
  other.hold_nominal();
  return held_out_errors(other).sum() - held_out_errors(model).sum() >
         kClearScore * noise_unit(model);
}

}  // namespace

ChannelModel without_step(const ChannelModel& model, std::size_t step) {
  ChannelModel out = model;
  const Index at = model.step_at(step);
  out.steps.erase(out.steps.begin() + static_cast<std::ptrdiff_t>(step));
  const auto erase = [at](MatrixXd& x) {
    const Index behind = x.cols() - at - 1;
    x.middleCols(at, behind) = x.rightCols(behind).eval();
    x.conservativeResize(Eigen::NoChange, x.cols() - 1);
  };
  erase(out.base);
  erase(out.free_base);
  const Index behind = out.precision.size() - at - 1;
  out.precision.segment(at, behind) = out.precision.tail(behind).eval();
  out.precision.conservativeResize(out.precision.size() - 1);
  out.hold_nominal();
  return out;
}

std::optional<ChannelModel> with_steps(const ChannelModel& plain) {
  const Series& series = *plain.series;
  if (series.stage != Stage::kTransmission) return std::nullopt;
  ChannelModel model = plain;
  auto steps = find_steps(series, model.blocks, model.noise, model.correlation_rows);
  std::erase_if(steps, [&](const Step& step) { return std::abs(step.size) < model.floor; });
  for (const Step& step : steps) append_step(model, step);
  if (steps.empty()) append_hidden_step(model);
  return model.steps.empty() ? std::nullopt : std::optional(std::move(model));
}

void drop_unproven_steps(ChannelModel& model, const Gates& gates, std::uint64_t seed) {
  for (std::size_t k = model.steps.size(); k-- > 0;) {
    ChannelModel rest = without_step(model, k);
    const VectorXd before = held_out_errors(rest);
    const VectorXd gains = before - held_out_errors(model);
    const bool proven =
        repeats(gates, z_score(gains), sign_flip_p(gains, derived_seed(seed, "steps", k))) &&
        gains.sum() > gates.least_share * before.sum() && is_within_its_stretch(model, k);
    if (!proven) model = std::move(rest);
  }
}

}  // namespace ravencal::diagnose
