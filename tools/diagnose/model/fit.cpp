// SPDX-License-Identifier: Apache-2.0
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/side_by_side.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/model/model.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kIterations = 8;
/// Where bounds hold a step back, so many shorter ones are tried.
constexpr int kShorterSteps = 4;
/// A step that gains less of the loss is the last one.
constexpr double kLeastFitGain = 0.3;

/// Steps of the finite difference go where the bounds are not.
double step_of(const Parameter& parameter) {
  return parameter.x + parameter.step > parameter.high ? -parameter.step : parameter.step;
}

/// Innovations and priors as residuals whose squares are Huber's loss and the priors' penalties.
class Residuals : public ceres::CostFunction {
 public:
  Residuals(const Likelihood& likelihood, Model& model)
      : likelihood_(likelihood), model_(model), free_(model.free()) {
    mutable_parameter_block_sizes()->push_back(static_cast<int>(free_.size()));
    set_num_residuals(static_cast<int>(likelihood.rows()) + static_cast<int>(free_.size()));
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const auto count = static_cast<Index>(free_.size());
    for (Index k = 0; k < count; ++k) free_[static_cast<std::size_t>(k)]->x = x[0][k];
    const State state = model_.state_for(likelihood_);
    const Outcome outcome = likelihood_.outcome(state);
    const VectorXd innovations = likelihood_.whitened(likelihood_.residuals(state, outcome));
    const Index rows = innovations.size();
    VectorXd slopes(rows);
    for (Index i = 0; i < rows; ++i) residuals[i] = huberised(innovations[i], slopes[i]);
    for (Index k = 0; k < count; ++k) {
      const Parameter& p = *free_[static_cast<std::size_t>(k)];
      residuals[rows + k] = (p.x - p.mean) / p.deviation;
    }
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(
        jacobians[0], rows + count, count);
    jacobian.setZero();
    core::for_each_index(free_.size(), likelihood_.threads(), [&](std::size_t i) {
      const Parameter& p = *free_[i];
      const auto k = static_cast<Index>(i);
      VectorXd column(rows);
      likelihood_.add_column(state, outcome, p, step_of(p), column);
      jacobian.col(k).head(rows) = -slopes.cwiseProduct(column);
      jacobian(rows + k, k) = 1.0 / p.deviation;
    });
    return true;
  }

 private:
  /// The signed root of Huber's loss, and its slope.
  static double huberised(double e, double& slope) {
    const double size = std::abs(e);
    slope = 1.0;
    if (size <= kHuber) return e;
    const double root = std::sqrt(2.0 * kHuber * size - kHuber * kHuber);
    slope = kHuber / root;
    return e > 0.0 ? root : -root;
  }

  const Likelihood& likelihood_;
  Model& model_;
  std::vector<Parameter*> free_;
};

MatrixXd prior_curvature(const std::vector<const Parameter*>& free) {
  MatrixXd out = MatrixXd::Zero(static_cast<Index>(free.size()), static_cast<Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    out(static_cast<Index>(k), static_cast<Index>(k)) =
        1.0 / (free[k]->deviation * free[k]->deviation);
  return out;
}

/// Covariance of the scores, blocks as observations.
MatrixXd score_covariance(const Likelihood& likelihood, const Linearised& at) {
  const Index count = at.columns.cols();
  MatrixXd scores = MatrixXd::Zero(likelihood.block_count(), count);
  for (Index i = 0; i < at.innovations.size(); ++i) {
    const double weighted = at.root_weights[i] * at.root_weights[i] * at.innovations[i];
    if (weighted != 0.0)
      scores.row(likelihood.blocks()[static_cast<std::size_t>(i)]) += weighted * at.columns.row(i);
  }
  const auto blocks = static_cast<double>(likelihood.block_count());
  scores.rowwise() -= scores.colwise().mean();
  return scores.transpose() * scores * (blocks / (blocks - 1.0));
}

}  // namespace

Linearised linearise(const Likelihood& likelihood, const Model& model) {
  const std::vector<const Parameter*> free = model.free();
  Linearised at;
  at.state = model.state_for(likelihood);
  at.outcome = likelihood.outcome(at.state);
  at.innovations = likelihood.whitened(likelihood.residuals(at.state, at.outcome));
  at.root_weights = root_weights(at.innovations);
  at.columns.resize(likelihood.rows(), static_cast<Index>(free.size()));
  core::for_each_index(free.size(), likelihood.threads(), [&](std::size_t k) {
    likelihood.add_column(at.state, at.outcome, *free[k], step_of(*free[k]),
                          at.columns.col(static_cast<Index>(k)));
  });
  const MatrixXd weighted = at.root_weights.asDiagonal() * at.columns;
  at.curvature = weighted.transpose() * weighted + prior_curvature(free);
  return at;
}

void fit(const Likelihood& likelihood, Model& model) {
  const std::vector<Parameter*> free = model.free();
  std::vector<double> x;
  for (const Parameter* p : free) x.push_back(p->bounded(p->x));
  ceres::Problem problem;
  problem.AddResidualBlock(new Residuals(likelihood, model), nullptr, x.data());
  for (std::size_t k = 0; k < free.size(); ++k) {
    const int index = static_cast<int>(k);
    if (std::isfinite(free[k]->low)) problem.SetParameterLowerBound(x.data(), index, free[k]->low);
    if (std::isfinite(free[k]->high))
      problem.SetParameterUpperBound(x.data(), index, free[k]->high);
  }
  double cost = 0.0;
  problem.Evaluate({}, &cost, nullptr, nullptr, nullptr);
  ceres::Solver::Options options;
  options.max_num_iterations = kIterations;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.function_tolerance = 0.5 * kLeastFitGain / std::max(cost, kLeastFitGain);
  // Cubic interpolation takes a Jacobian at every step that is tried.
  options.line_search_interpolation_type = ceres::QUADRATIC;
  options.max_num_line_search_step_size_iterations = kShorterSteps;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t k = 0; k < free.size(); ++k) free[k]->x = free[k]->bounded(x[k]);
}

void judge(const Likelihood& likelihood, double cost, Model& model) {
  const Linearised at = linearise(likelihood, model);
  const std::vector<const Parameter*> free = std::as_const(model).free();
  const auto count = static_cast<Index>(free.size());
  const MatrixXd inverse = at.curvature.ldlt().solve(MatrixXd::Identity(count, count));
  const MatrixXd scores = score_covariance(likelihood, at);
  const MatrixXd priors = prior_curvature(free);
  Judgement& out = model.judgement;
  out.loss = huber_loss(at.innovations);
  out.trace = (inverse * scores).trace();
  const double expected = (inverse * (at.curvature - priors)).trace();
  out.dispersion = std::max(1.0, out.trace / std::max(1e-9, expected));
  const double dispersion = likelihood.dispersion();
  out.covariance = inverse * (scores + priors) * inverse;
  // No deviation is below that of independent rows; correlations stay.
  const VectorXd wider =
      (inverse.diagonal().array() / out.covariance.diagonal().array()).max(1.0).sqrt().matrix();
  out.covariance = dispersion * wider.asDiagonal() * out.covariance * wider.asDiagonal();
  out.penalty = model.prior() + cost;
  out.score = out.score_at(dispersion);
}

namespace {

/// Place of the number among `places` that is the fewest deviations from the plant's, if it is
/// within chance.
std::optional<std::size_t> least_certain(const std::vector<std::size_t>& places,
                                         const VectorXd& off, const MatrixXd& covariance) {
  std::optional<std::size_t> least;
  double least_z = kChance5_z;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const auto i = static_cast<Index>(places[n]);
    const double z = std::abs(off[i]) / std::sqrt(covariance(i, i));
    if (!(z < least_z)) continue;
    least_z = z;
    least = n;
  }
  return least;
}

}  // namespace

void hold_uncertain(const Likelihood& likelihood, const std::set<std::size_t>& opened,
                    Model& model) {
  const std::vector<Parameter*> free = model.free();
  VectorXd off(static_cast<Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    off[static_cast<Index>(k)] = free[k]->x - free[k]->mean;
  MatrixXd covariance = model.judgement.covariance;
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < model.numbers.size(); ++k)
    if (model.numbers[k].in_plant && !opened.contains(k)) places.push_back(k);
  for (auto n = least_certain(places, off, covariance); n;
       n = least_certain(places, off, covariance)) {
    // The others go on as if it were known: conditional mean and covariance of a normal.
    const auto i = static_cast<Index>(places[*n]);
    const VectorXd gain = covariance.col(i) / covariance(i, i);
    off -= gain * off[i];
    covariance -= gain * covariance.row(i).eval();
    free[places[*n]]->held = true;
    places.erase(places.begin() + static_cast<std::ptrdiff_t>(*n));
  }
  fit(likelihood, model);
}

}  // namespace ravencal::diagnose
