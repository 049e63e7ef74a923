// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/findings/policy.hpp"
#include "diagnose/selection/contenders.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Cuts into blocks until they are as long as the noise within them asks for.
constexpr int kBlockRounds = 4;

/// Ridge of the saturated model relative to each column's energy: it holds columns that imitate
/// each other and costs 0.1 % of a real effect.
constexpr double kSaturatedRidge = 1e-3;

std::shared_ptr<const FormCandidate> candidate_of(const Series& series, const Blocks& blocks,
                                                  const EffectForm& form) {
  auto candidate = std::make_shared<FormCandidate>();
  candidate->form = &form;
  candidate->untestable = form.untestable(series);
  if (!candidate->untestable.empty()) return candidate;
  for (const Shape& shape : form.grid(series)) {
    candidate->columns.push_back(blocks.gather(seen_columns(form, series, shape)));
    candidate->shapes.push_back(shape);
  }
  return candidate;
}

/// Energy per training row of the candidates that may have acted once only.
std::vector<VectorXd> events_of(const ChannelModel& model) {
  std::vector<VectorXd> events;
  for (const auto& candidate : model.candidates) {
    if (!candidate->form->occasional()) continue;
    for (const MatrixXd& columns : candidate->columns)
      events.emplace_back(columns.rowwise().squaredNorm());
  }
  return events;
}

/// Without its mean over a twelfth of the recording around each row: a drift or a step is no noise,
/// and would make blocks of a few minutes out of noise that remembers a second.
VectorXd without_trend(const Series& series, const Blocks& blocks, const VectorXd& x) {
  VectorXd out = x;
  const Index count = x.size();
  const auto recording_of = [&](Index n) {
    const Index row = blocks.rows[static_cast<std::size_t>(n)];
    return series.recording[static_cast<std::size_t>(row)];
  };
  for (Index first = 0, last = 0; first < count; first = last) {
    while (last < count && recording_of(last) == recording_of(first)) ++last;
    const Index reach = (last - first) / 24;
    if (reach < 25) continue;
    VectorXd sum = VectorXd::Zero(last - first + 1);
    for (Index n = first; n < last; ++n) sum[n - first + 1] = sum[n - first] + x[n];
    for (Index n = first; n < last; ++n) {
      const Index from = std::max(first, n - reach) - first;
      const Index to = std::min(last, n + reach + 1) - first;
      out[n] -= (sum[to] - sum[from]) / static_cast<double>(to - from);
    }
  }
  return out;
}

double rms(const VectorXd& x) {
  return x.size() > 0 ? std::sqrt(x.squaredNorm() / static_cast<double>(x.size())) : 0.0;
}

void set_precision(ChannelModel& model, const std::vector<NominalTerm>& terms) {
  const double variance = model.noise.squaredNorm() / static_cast<double>(model.noise.size());
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const double tolerance = std::max(terms[i].tolerance, 1e-6);
    model.precision[static_cast<Index>(i) + 1] =
        variance * model.correlation_rows / (tolerance * tolerance);
  }
}

}  // namespace

bool is_among(const std::vector<std::size_t>& candidates, std::size_t candidate) {
  return std::find(candidates.begin(), candidates.end(), candidate) != candidates.end();
}

bool same_column(const VectorXd& a, const VectorXd& b) {
  constexpr double kCosine = 0.99999;
  return std::abs(a.dot(b)) > kCosine * a.norm() * b.norm();
}

MatrixXd ChannelModel::columns() const {
  Index count = base.cols();
  for (const Chosen& c : chosen) count += c.columns.cols();
  MatrixXd all(base.rows(), count);
  all.leftCols(base.cols()) = base;
  Index at = base.cols();
  for (const Chosen& c : chosen) {
    all.middleCols(at, c.columns.cols()) = c.columns;
    at += c.columns.cols();
  }
  return all;
}

std::vector<std::size_t> ChannelModel::chosen_candidates() const {
  std::vector<std::size_t> out;
  for (const Chosen& c : chosen) out.push_back(c.candidate);
  return out;
}

Index ChannelModel::first_column(std::size_t effect) const {
  Index at = base.cols();
  for (std::size_t i = 0; i < effect; ++i) at += chosen[i].columns.cols();
  return at;
}

VectorXd ChannelModel::column_precision(Index count) const {
  VectorXd all = VectorXd::Zero(count);
  all.head(precision.size()) = precision;
  return all;
}

bool ChannelModel::permits(const EffectForm& form) const {
  const std::string needed = form.prerequisite();
  if (needed.empty() ||
      std::find(nominal_ids.begin(), nominal_ids.end(), needed) != nominal_ids.end())
    return true;
  return std::any_of(chosen.begin(), chosen.end(), [&](const Chosen& c) {
    return candidates[c.candidate]->form->id() == needed;
  });
}

void ChannelModel::take_noise(Eigen::VectorXd residual) {
  noise = std::move(residual);
  floor = std::min(floor, rms(noise));
}

bool ChannelModel::offers(std::size_t candidate) const {
  const FormCandidate& c = *candidates[candidate];
  if (!c.untestable.empty() || !permits(*c.form)) return false;
  if (is_among(chosen_candidates(), candidate)) return false;
  const auto term = c.form->nominal_term();
  return !term || held[*term] != 0.0;
}

ChannelModel ChannelModel::with(const Chosen& effect) const {
  ChannelModel more = *this;
  more.chosen.push_back(effect);
  more.hold_nominal();
  return more;
}

ChannelModel ChannelModel::without(std::size_t effect) const {
  ChannelModel rest = *this;
  rest.chosen.erase(rest.chosen.begin() + static_cast<std::ptrdiff_t>(effect));
  rest.hold_nominal();
  return rest;
}

void ChannelModel::hold_nominal() {
  base = free_base;
  target = free_target;
  std::fill(held.begin(), held.end(), 0.0);
  for (const Chosen& c : chosen) {
    if (const auto term = candidates[c.candidate]->form->nominal_term())
      base.col(static_cast<Index>(*term) + 1).setZero();
    // An effect with the column of a number of the plant takes its whole change.
    for (std::size_t term = 0; term < limit.size() && c.columns.cols() == 1; ++term) {
      auto own = base.col(static_cast<Index>(term) + 1);
      if (same_column(own, c.columns.col(0))) own.setZero();
    }
  }
  const MatrixXd all = columns();
  VectorXd most = VectorXd::Constant(all.cols(), std::numeric_limits<double>::infinity());
  for (std::size_t term = 0; term < limit.size(); ++term)
    most[static_cast<Index>(term) + 1] = limit[term];
  const VectorXd b =
      solve_within(moments_of(blocks, all, target).total(), column_precision(all.cols()), most);
  for (std::size_t term = 0; term < limit.size(); ++term) {
    const Index column = static_cast<Index>(term) + 1;
    if (std::abs(b[column]) < limit[term]) continue;
    held[term] = b[column];
    target -= held[term] * free_base.col(column);
    base.col(column).setZero();
  }
}

VectorXd joint_fit(const ChannelModel& model) {
  const MatrixXd columns = model.columns();
  const Moments moments = moments_of(model.blocks, columns, model.target);
  VectorXd b = solve(moments.total(), model.column_precision(columns.cols()));
  for (std::size_t term = 0; term < model.held.size(); ++term) {
    if (model.held[term] != 0.0) b[static_cast<Index>(term) + 1] = model.held[term];
  }
  return b;
}

double ChannelModel::rms_of(const VectorXd& block_errors) const {
  return std::sqrt(block_errors.sum() / static_cast<double>(std::max<Index>(1, target.size())));
}

ChannelModel prepare_channel(const Series& series, const Nominal& nominal, const Forms& forms) {
  ChannelModel model;
  model.series = &series;
  // A first cut into forty; the next know how long the noise remembers.
  const double first_guess_rows = static_cast<double>(series.rows()) / 200.0;
  model.blocks = make_blocks(series, first_guess_rows);
  model.target = model.blocks.gather(series.y - nominal.prediction);
  if (series.payload_effort.size() > 0)
    model.target -= model.blocks.gather(series.as_seen(series.payload_effort));
  const auto terms = static_cast<Index>(nominal.terms.size());
  MatrixXd base(series.rows(), terms + 1);
  base.col(0).setOnes();
  for (Index i = 0; i < terms; ++i)
    base.col(i + 1) = nominal.terms[static_cast<std::size_t>(i)].column;
  for (const NominalTerm& term : nominal.terms) {
    model.limit.push_back(kBeyondTolerance * term.tolerance);
    model.tolerance.push_back(std::max(term.tolerance, 1e-6));
    model.held.push_back(0.0);
  }
  model.base = model.blocks.gather(base);
  model.free_base = model.base;
  model.free_target = model.target;
  model.precision = VectorXd::Zero(terms + 1);
  for (const NominalTerm& term : nominal.terms) {
    model.nominal_ids.push_back(term.id);
    model.nominal_parameters.push_back(term.parameter);
  }
  for (const auto& form : forms)
    model.candidates.push_back(candidate_of(series, model.blocks, *form));
  const std::vector<VectorXd> events = events_of(model);
  model.blocks = make_blocks(series, first_guess_rows, events);
  double assumed_rows = 0.0;
  for (int round = 0; round < kBlockRounds; ++round) {
    model.noise = saturated_noise(model);
    model.correlation_rows = noise_memory(model, model.noise);
    set_precision(model, nominal.terms);
    model.hold_nominal();
    // Short blocks let the fit follow what the noise remembers, which then seems to forget.
    if (round > 0 && model.correlation_rows < 1.5 * assumed_rows) break;
    assumed_rows = model.correlation_rows;
    model.blocks = make_blocks(series, assumed_rows, events);
  }
  model.floor = rms(model.noise);
  return model;
}

VectorXd saturated_noise(const ChannelModel& model) {
  const MatrixXd present = model.columns();
  const VectorXd precision = model.column_precision(present.cols());
  const Moments moments = moments_of(model.blocks, present, model.target);
  const double alone = held_out_error(model.blocks, moments, precision).sum();
  MatrixXd all = present;
  for (std::size_t c = 0; c < model.candidates.size(); ++c) {
    const FormCandidate& candidate = *model.candidates[c];
    if (!model.offers(c)) continue;
    const MatrixXd* best = nullptr;
    double least = alone;
    for (const MatrixXd& columns : candidate.columns) {
      const Moments with = extended(model.blocks, moments, present, columns, model.target);
      const double error =
          held_out_error(model.blocks, with, model.column_precision(with.columns())).sum();
      if (error < least) {
        least = error;
        best = &columns;
      }
    }
    if (best == nullptr) continue;
    all.conservativeResize(Eigen::NoChange, all.cols() + best->cols());
    all.rightCols(best->cols()) = *best;
  }
  VectorXd residual = held_out_residual(model.blocks, moments, precision, present, model.target);
  if (all.cols() == present.cols()) return residual;
  const Moments saturated = moments_of(model.blocks, all, model.target);
  VectorXd rich = held_out_residual(model.blocks, saturated, model.column_precision(all.cols()),
                                    all, model.target, kSaturatedRidge);
  return rich.squaredNorm() < residual.squaredNorm() ? rich : residual;
}

double noise_memory(const ChannelModel& model, const VectorXd& noise) {
  return correlation_length(*model.series, model.blocks,
                            without_trend(*model.series, model.blocks, noise));
}

Evidence evidence_of(const ChannelModel& model, std::size_t chosen, const Gates& gates,
                     std::uint64_t seed) {
  // The test keeps the shape that the whole model settled on.
  ChannelModel alone = model.without(chosen);
  const std::size_t index = model.chosen[chosen].candidate;
  auto fixed = std::make_shared<FormCandidate>(*model.candidates[index]);
  fixed->shapes = {model.chosen[chosen].shape};
  fixed->columns = {model.chosen[chosen].columns};
  alone.candidates[index] = fixed;
  const ScreenResult result = screen(alone, gates, seed);
  for (const TestedCandidate& tested : result.tested) {
    if (tested.candidate != index) continue;
    const auto rows = static_cast<double>(std::max<Index>(1, model.target.size()));
    return anew(tested.evidence, result.errors, held_out_errors(model), rows, seed);
  }
  return {};
}

}  // namespace ravencal::diagnose
