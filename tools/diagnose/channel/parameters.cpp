// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/fit/standard_normal.hpp"
#include "diagnose/selection/invariance.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kResamples = 400;

/// Moments of the blocks drawn with replacement.
MatrixXd resampled(const Moments& moments, std::mt19937_64& engine) {
  MatrixXd sum = MatrixXd::Zero(moments.block.front().rows(), moments.block.front().cols());
  for (std::size_t n = 0; n < moments.block.size(); ++n) {
    sum += moments.block[engine() % moments.block.size()];
  }
  return sum;
}

/// A least squares problem whose blocks and priors are drawn anew.
struct Drawn {
  Moments moments;
  VectorXd precision;
  std::optional<Index> bend;  ///< column that no fit has, its prior deviation 1
};

/// The chosen effect's columns, moved along its shape to first order where that is free.
struct Tangent {
  MatrixXd columns;  ///< of the whole model, the shape's own last
  bool with_shape = false;
  Index at = 0;  ///< of the effect's first coefficient
  Index width = 0;
};

Tangent tangent_of(const ChannelFit& fit, std::size_t chosen) {
  const ChannelModel& model = fit.model;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  Tangent t{model.columns(), false, model.first_column(chosen), own.columns.cols()};
  t.with_shape = form.continuous() && !own.shape.empty() && !form.unit_coefficient(*model.series);
  if (!t.with_shape) return t;
  constexpr double kStep = 0.02;
  const MatrixXd moved =
      model.blocks.gather(seen_columns(form, *model.series, {own.shape[0] * (1.0 + kStep)}));
  // A part of a joint replay moves with its shape as the effect alone would.
  const MatrixXd alone = own.everywhere.size() > 0
                             ? model.blocks.gather(seen_columns(form, *model.series, own.shape))
                             : own.columns;
  t.columns.conservativeResize(Eigen::NoChange, t.columns.cols() + 1);
  t.columns.rightCols(1) =
      (moved - alone).leftCols(t.width) * fit.coefficients.segment(t.at, t.width) / kStep;
  return t;
}

/// Error of one deviation that a straight cable makes where the real one stiffens under load: a
/// cube of its stretch, anything up to the model's form. Empty where no cable is seen.
VectorXd bend_of(const ChannelFit& fit) {
  if (fit.model.series->stage != Stage::kTransmission) return {};
  const VectorXd stretch = stretch_of(fit);
  const VectorXd cube = stretch.array().cube();
  if (!(cube.norm() > 0.0)) return {};
  return (kModelForm / std::sqrt(3.0) * stretch.norm() / cube.norm()) * cube;
}

/// Those columns; with the bend beside them where the model's form is in doubt too.
Drawn drawn_from(const ChannelFit& fit, const MatrixXd& columns, Doubt doubt) {
  const ChannelModel& model = fit.model;
  const VectorXd bend = doubt == Doubt::kChance ? VectorXd() : bend_of(fit);
  if (bend.size() == 0)
    return {moments_of(model.blocks, columns, model.target), model.column_precision(columns.cols()),
            std::nullopt};
  MatrixXd more(columns.rows(), columns.cols() + 1);
  more << columns, bend;
  Drawn out{moments_of(model.blocks, more, model.target), model.column_precision(more.cols()),
            columns.cols()};
  out.precision[columns.cols()] =
      model.noise.squaredNorm() / static_cast<double>(model.noise.size()) * model.correlation_rows;
  return out;
}

/// One bootstrap draw of the coefficients: blocks with replacement, and each nominal number from
/// its own tolerance, which the fit takes for known.
VectorXd drawn_coefficients(const ChannelFit& fit, const Drawn& from, std::mt19937_64& engine) {
  MatrixXd sum = resampled(from.moments, engine);
  const Index last = sum.cols() - 1;
  const auto draw_prior = [&](Index column, double deviation) {
    sum(column, last) += from.precision[column] * deviation * standard_normal(engine);
    sum(last, column) = sum(column, last);
  };
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t)
    draw_prior(static_cast<Index>(t) + 1, fit.model.tolerance[t]);
  if (from.bend) draw_prior(*from.bend, 1.0);
  return solve(sum, from.precision, 1e-6);
}

/// Factor of a bootstrap's deviations: with few blocks it knows less of the spread between them
/// than it says (Efron 1982).
double few_blocks(std::size_t blocks, Index free) {
  const double degrees = std::max(3.0, static_cast<double>(blocks) - static_cast<double>(free));
  return std::sqrt((degrees + 1.0) / degrees) * student_per_normal95(degrees);
}

/// Variance that slow noise adds to a coefficient over time, in squared 95 % half widths: sensors
/// wander, and blocks that follow each other share it. From the lowest cosines of the blocks'
/// scores (Lazarus, Lewis, Stock and Watson, JBES 2018), beyond what blocks that share nothing say.
double slow_noise(const Drawn& from, Index column) {
  const MatrixXd total = from.moments.total();
  const Index last = total.cols() - 1;
  const VectorXd b = solve(total, from.precision, 1e-6);
  MatrixXd unit = total;
  unit.col(last).setZero();
  unit(column, last) = 1.0;
  const VectorXd influence = solve(unit, from.precision, 1e-6);
  const auto count = static_cast<Index>(from.moments.block.size());
  VectorXd scores(count);
  for (Index n = 0; n < count; ++n) {
    const MatrixXd& m = from.moments.block[static_cast<std::size_t>(n)];
    scores[n] = influence.dot(m.col(last).head(last) - m.topLeftCorner(last, last) * b);
  }
  const auto blocks = static_cast<double>(count);
  const Index cosines = std::max<Index>(2, std::lround(0.4 * std::pow(blocks, 2.0 / 3.0)));
  double power = 0.0;
  for (Index k = 1; k <= cosines; ++k) {
    const double step = std::numbers::pi * static_cast<double>(k) / blocks;
    double sum = 0.0;
    for (Index n = 0; n < count; ++n)
      sum += scores[n] * std::cos(step * (static_cast<double>(n) + 0.5));
    power += 2.0 * sum * sum;
  }
  const double degrees = static_cast<double>(cosines);
  const double shared = std::pow(student_per_normal95(degrees), 2) * power / degrees;
  const double alone = std::pow(few_blocks(from.moments.block.size(), 1), 2) * scores.squaredNorm();
  return kNormal95 * kNormal95 * std::max(0.0, shared - alone);
}

/// The interval with independent variance, in squared half widths, on both sides.
Interval widened(const Interval& ci, double value, double variance) {
  const double more = std::sqrt(variance);
  return {value - std::hypot(value - ci.first, more), value + std::hypot(ci.second - value, more)};
}

/// Central 95 % of the draws about the value, each side wider by that factor. Draws know no limits
/// of the plant's numbers and may scatter about another centre: the scatter counts to both sides,
/// and the way to that centre on its own.
std::pair<double, double> interval_of(std::vector<double>& draws, double value, double wider) {
  std::sort(draws.begin(), draws.end());
  const double low = draws[static_cast<std::size_t>(0.025 * kResamples)];
  const double middle = draws[kResamples / 2];
  const double high = draws[static_cast<std::size_t>(0.975 * kResamples) - 1];
  return {value - wider * std::max(middle - low, value - low),
          value + wider * std::max(high - middle, high - value)};
}

/// The same of a number that is positive by nature: in its logarithm.
std::pair<double, double> positive_interval_of(std::vector<double>& draws, double value,
                                               double wider) {
  for (double& draw : draws) draw = std::log(draw);
  const auto [low, high] = interval_of(draws, std::log(value), wider);
  return {std::exp(low), std::exp(high)};
}

/// Deviation of an effect's coefficient that a number of the plant with the same column leaves: the
/// effect was given its whole change.
double taken_deviation(const ChannelModel& model, const Chosen& own) {
  if (own.columns.cols() != 1) return 0.0;
  double squares = 0.0;
  for (std::size_t t = 0; t < model.tolerance.size(); ++t) {
    const VectorXd column = model.free_base.col(static_cast<Index>(t) + 1);
    if (!same_column(column, own.columns.col(0))) continue;
    const double ratio = column.norm() / own.columns.norm();
    squares += std::pow(model.tolerance[t] * ratio, 2);
  }
  return std::sqrt(squares);
}

}  // namespace

std::vector<NamedParameter> parameters_of(const ChannelFit& fit, std::size_t chosen,
                                          std::uint64_t seed, Doubt doubt) {
  const ChannelModel& model = fit.model;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  const Tangent tangent = tangent_of(fit, chosen);
  const Drawn from = drawn_from(fit, tangent.columns, doubt);
  const auto central = form.parameters(*model.series, own.shape,
                                       fit.coefficients.segment(tangent.at, tangent.width));
  std::vector<std::vector<double>> draws(central.size());
  std::mt19937_64 engine(seed);
  const double taken = form.nominal_term() ? 0.0 : taken_deviation(model, own);
  for (int r = 0; r < kResamples; ++r) {
    VectorXd drawn = drawn_coefficients(fit, from, engine);
    if (taken > 0.0) drawn[tangent.at] += taken * standard_normal(engine);
    Shape shape = own.shape;
    if (tangent.with_shape)
      shape[0] *= std::exp(std::clamp(drawn[tangent.columns.cols() - 1], -0.7, 0.7));
    const auto values =
        form.parameters(*model.series, shape, drawn.segment(tangent.at, tangent.width));
    for (std::size_t p = 0; p < values.size() && p < draws.size(); ++p)
      draws[p].push_back(values[p].value);
  }
  const double wider =
      few_blocks(model.blocks.count(), tangent.width + (tangent.with_shape ? 1 : 0));
  std::vector<NamedParameter> out;
  for (std::size_t p = 0; p < central.size(); ++p) {
    const double value = central[p].value;
    // The first is a size, which may be none; what is positive in every draw beside it is a shape.
    const bool shape =
        p > 0 && value > 0.0 && *std::min_element(draws[p].begin(), draws[p].end()) > 0.0;
    out.push_back({central[p].name, value, central[p].unit,
                   shape ? positive_interval_of(draws[p], value, wider)
                         : interval_of(draws[p], value, wider)});
  }
  if (doubt != Doubt::kFormToo || !form.time_only()) return out;
  const std::size_t sizes = std::min(out.size(), form.sizes(*model.series));
  for (std::size_t p = 0; p < sizes; ++p) {
    const Index column = tangent.at + std::min(static_cast<Index>(p), tangent.width - 1);
    out[p].ci95 = widened(out[p].ci95, out[p].value, slow_noise(from, column));
  }
  return out;
}

Interval interval_over_time(const ChannelFit& fit, Index column, std::uint64_t seed, Doubt doubt) {
  const Drawn from = drawn_from(fit, fit.model.columns(), doubt);
  std::vector<double> draws;
  std::mt19937_64 engine(seed);
  for (int r = 0; r < kResamples; ++r)
    draws.push_back(drawn_coefficients(fit, from, engine)[column]);
  const double value = fit.coefficients[column];
  const Interval ci = interval_of(draws, value, few_blocks(fit.model.blocks.count(), 1));
  return doubt == Doubt::kChance ? ci : widened(ci, value, slow_noise(from, column));
}

std::optional<Interval> friction_behind(const ChannelFit& fit, const ChannelOptions& options) {
  const auto& terms = fit.nominal->terms;
  const auto level = std::find_if(terms.begin(), terms.end(), [](const NominalTerm& t) {
    return traits_of(t.id).friction == Friction::kBehindCable && t.parameter == "level" &&
           !t.form_only;
  });
  if (fit.model.series->stage != Stage::kTransmission || level == terms.end()) return std::nullopt;
  const auto term = static_cast<std::size_t>(level - terms.begin());
  const auto column = static_cast<Index>(term) + 1;
  ChannelFit free = fit;
  ChannelModel& model = free.model;
  model.base.col(column) = model.free_base.col(column);
  model.target += model.held[term] * model.free_base.col(column);
  model.held[term] = 0.0;
  model.precision[column] = 0.0;
  free.coefficients = joint_fit(model);
  const auto [low, high] =
      widened(interval_over_time(free, column, derived_seed(options.seed, "friction behind"),
                                 Doubt::kFormToo),
              free.coefficients[column], std::pow(kNormal95 * kModelForm, 2));
  return Interval{level->value * (1.0 + low), level->value * (1.0 + high)};
}

void widen_by_form(const Invariance& invariance, bool of_cable,
                   std::vector<NamedParameter>& parameters) {
  if (parameters.empty()) return;
  const double relative =
      kNormal95 * std::hypot(invariance.deviation(), of_cable ? kModelForm : 0.0);
  NamedParameter& size = parameters.front();
  size.ci95 = widened(size.ci95, size.value, std::pow(relative * size.value, 2));
}

void widen_by_held(const ChannelFit& fit, std::size_t chosen,
                   std::vector<NamedParameter>& parameters) {
  const ChannelModel& model = fit.model;
  const auto holds = [](double held) { return held != 0.0; };
  if (parameters.empty() || std::none_of(model.held.begin(), model.held.end(), holds)) return;
  const Chosen& own = model.chosen[chosen];
  const EffectForm& form = *model.candidates[own.candidate]->form;
  const MatrixXd columns = model.columns();
  const VectorXd precision = model.column_precision(columns.cols());
  MatrixXd moments = moments_of(model.blocks, columns, model.target).total();
  NamedParameter& size = parameters.front();
  double low = std::pow(size.value - size.ci95.first, 2);
  double high = std::pow(size.ci95.second - size.value, 2);
  for (std::size_t t = 0; t < model.held.size(); ++t) {
    if (!holds(model.held[t])) continue;
    const VectorXd inward = std::copysign(model.tolerance[t], model.held[t]) *
                            model.free_base.col(static_cast<Index>(t) + 1);
    moments.col(columns.cols()).head(columns.cols()) = columns.transpose() * inward;
    const VectorXd b = fit.coefficients + solve(moments, precision);
    const auto moved = form.parameters(*model.series, own.shape,
                                       b.segment(model.first_column(chosen), own.columns.cols()));
    const double change = moved.front().value - size.value;
    (change < 0.0 ? low : high) += std::pow(kNormal95 * change, 2);
  }
  size.ci95 = {size.value - std::sqrt(low), size.value + std::sqrt(high)};
}

}  // namespace ravencal::diagnose
