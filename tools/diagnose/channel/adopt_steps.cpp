// SPDX-License-Identifier: Apache-2.0
//
// Steps of the transmission at one moment are looked for before anything has a name: they would
// bend whatever is fitted beside them.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void append_step(ChannelFit& fit, const Step& step) {
  ChannelModel& model = fit.model;
  fit.steps.push_back(step);
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
/// nothing; whether it is real is asked by the likelihood of the whole model (keep_proven_steps).
/// From one start to the next homing may have changed, which bends as much and is no step.
void adopt_hidden_step(ChannelFit& fit) {
  constexpr double kSuspicious = 0.15;
  constexpr double kMostLeft = 0.75;
  constexpr int kTurns = 6;
  ChannelModel& model = fit.model;
  if (stretches_of(*model.series, model.blocks.rows).size() > 1) return;
  auto [suspect, share] = likeliest_step(model);
  if (share < kSuspicious) return;
  const Index near = std::max<Index>(4, model.target.size() / 1000);
  for (int turn = 0; turn < kTurns; ++turn) {
    ChannelFit trial;
    trial.model = model;
    append_step(trial, suspect);
    trial.model.hold_nominal();
    const VectorXd noise = saturated_noise(trial.model);
    const VectorXd coefficients = joint_fit(trial.model);
    suspect.size = coefficients[coefficients.size() - 1];
    const VectorXd column = trial.model.base.rightCols(1);
    const Index row = likeliest_row(model, noise + suspect.size * column);
    if (std::abs(row - suspect.row) <= near) {
      const double memory = noise_memory(trial.model, noise);
      const auto rows = static_cast<double>(noise.size());
      const double variance = noise.squaredNorm() / rows;
      if (noise.squaredNorm() > kMostLeft * model.noise.squaredNorm()) return;
      const double energy = (column.array() - column.mean()).square().sum();
      suspect.window = near;
      suspect.deviation = std::sqrt(variance * memory / energy);
      suspect.p_value =
          chance_anywhere(std::abs(suspect.size) / suspect.deviation, 0.5 * rows / memory);
      append_step(fit, suspect);
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

}  // namespace

void adopt_steps(ChannelFit& fit) {
  ChannelModel& model = fit.model;
  const Series& series = *model.series;
  if (series.stage != Stage::kTransmission) return;
  auto steps = find_steps(series, model.blocks, model.noise, model.correlation_rows);
  std::erase_if(steps, [&](const Step& step) { return std::abs(step.size) < model.floor; });
  for (const Step& step : steps) append_step(fit, step);
  if (steps.empty()) adopt_hidden_step(fit);
}

}  // namespace ravencal::diagnose
