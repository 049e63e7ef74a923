// SPDX-License-Identifier: Apache-2.0
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

/// A step that promises less of the loss over the dispersion and of the priors is the last one: a
/// tenth of what scores tell apart.
constexpr double kLeastFitGain = 0.1;
/// Far more than a fit from the priors' means takes; it ends by the gain.
constexpr int kMostSteps = 60;
/// Marquardt's damping: share of the curvature's diagonal. Dampings above the largest move nothing.
constexpr double kFirstDamping = 1e-3, kLeastDamping = 1e-7, kLargestDamping = 1e8;
constexpr double kLessDamping = 0.2, kMoreDamping = 10.0;

/// Steps of the finite difference go where the bounds are not.
double step_of(const Parameter& parameter) {
  return parameter.x + parameter.step > parameter.high ? -parameter.step : parameter.step;
}

/// In units of the loss, which a score divides by the dispersion.
MatrixXd prior_curvature(const std::vector<const Parameter*>& free, double dispersion) {
  VectorXd out(static_cast<Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    out[static_cast<Index>(k)] = dispersion / (free[k]->deviation * free[k]->deviation);
  return out.asDiagonal();
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

Linearised linearise(const Likelihood& likelihood, const Model& model, const VectorXd* counted) {
  const std::vector<const Parameter*> free = model.free();
  Linearised at;
  at.state = model.state_for(likelihood);
  at.outcome = likelihood.outcome(at.state);
  at.innovations = likelihood.whitened(likelihood.residuals(at.state, at.outcome));
  at.root_weights = root_weights(at.innovations);
  if (counted != nullptr) at.root_weights.array() *= counted->array();
  at.columns.resize(likelihood.rows(), static_cast<Index>(free.size()));
  core::for_each_index(free.size(), likelihood.threads(), [&](std::size_t k) {
    likelihood.add_column(at.state, at.outcome, *free[k], step_of(*free[k]),
                          at.columns.col(static_cast<Index>(k)));
  });
  const MatrixXd weighted = at.root_weights.asDiagonal() * at.columns;
  at.curvature = weighted.transpose() * weighted + prior_curvature(free, likelihood.dispersion());
  return at;
}

namespace {

/// Levenberg-Marquardt with an active set: parameters that a step would drive through their bounds
/// stay there, and the others make the best of it.
class Fit {
 public:
  Fit(const Likelihood& likelihood, Model& model, const VectorXd* counted)
      : likelihood_(likelihood), model_(model), counted_(counted), free_(model.free()) {
    for (Parameter* p : free_) p->x = p->bounded(p->x);
  }

  void run() {
    double loss = loss_of_model();
    for (int step = 0; step < kMostSteps && improves(loss); ++step) {
    }
  }

 private:
  /// With the priors: what a score tells apart, times the dispersion.
  [[nodiscard]] double loss_of_model() const {
    const State state = model_.state_for(likelihood_);
    VectorXd innovations =
        likelihood_.whitened(likelihood_.residuals(state, likelihood_.outcome(state)));
    if (counted_ != nullptr) innovations.array() *= counted_->array();
    return huber_loss(innovations) + likelihood_.dispersion() * model_.prior();
  }

  [[nodiscard]] VectorXd place() const {
    VectorXd x(static_cast<Index>(free_.size()));
    for (std::size_t k = 0; k < free_.size(); ++k) x[static_cast<Index>(k)] = free_[k]->x;
    return x;
  }
  void move_to(const VectorXd& x) {
    for (std::size_t k = 0; k < free_.size(); ++k)
      free_[k]->x = free_[k]->bounded(x[static_cast<Index>(k)]);
  }

  /// Takes a step that lowers the loss, if there is one worth it; false: the last one.
  bool improves(double& loss) {
    const VectorXd from = place();
    const Linearised at = linearise(likelihood_, model_, counted_);
    VectorXd descent =
        at.columns.transpose() * at.root_weights.cwiseAbs2().cwiseProduct(at.innovations);
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const Parameter& p = *free_[k];
      descent[static_cast<Index>(k)] -=
          likelihood_.dispersion() * (p.x - p.mean) / (p.deviation * p.deviation);
    }
    for (; damping_ < kLargestDamping; damping_ *= kMoreDamping) {
      const VectorXd step = step_within_bounds(at.curvature, descent);
      // The loss is twice the negative logarithm, and so is what the step promises of it.
      const double promised = 2.0 * descent.dot(step) - step.dot(at.curvature * step);
      if (!(promised > kLeastFitGain * likelihood_.dispersion())) return false;
      move_to(from + step);
      const double reached = loss_of_model();
      if (!(reached < loss)) continue;
      const double gained = loss - reached;
      loss = reached;
      if (gained > 0.5 * promised) damping_ = std::max(kLeastDamping, kLessDamping * damping_);
      return true;
    }
    move_to(from);
    return false;
  }

  [[nodiscard]] VectorXd step_within_bounds(const MatrixXd& curvature,
                                            const VectorXd& descent) const {
    const auto count = static_cast<Index>(free_.size());
    VectorXd step = VectorXd::Zero(count);
    std::vector<bool> is_bound(free_.size(), false);
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const double along = descent[static_cast<Index>(k)];
      is_bound[k] = (free_[k]->x <= free_[k]->low && along < 0.0) ||
                    (free_[k]->x >= free_[k]->high && along > 0.0);
    }
    for (bool is_within = false; !is_within;) {
      std::vector<Index> moving, bound;
      for (Index k = 0; k < count; ++k)
        (is_bound[static_cast<std::size_t>(k)] ? bound : moving).push_back(k);
      if (moving.empty()) return step;
      MatrixXd inner = curvature(moving, moving);
      inner.diagonal() *= 1.0 + damping_;
      const VectorXd wanted =
          inner.ldlt().solve(descent(moving) - curvature(moving, bound) * step(bound));
      is_within = true;
      for (std::size_t i = 0; i < moving.size(); ++i) {
        const auto k = static_cast<std::size_t>(moving[i]);
        const double to = free_[k]->x + wanted[static_cast<Index>(i)];
        step[moving[i]] = free_[k]->bounded(to) - free_[k]->x;
        if (free_[k]->bounded(to) == to) continue;
        is_bound[k] = true;
        is_within = false;
      }
    }
    return step;
  }

  const Likelihood& likelihood_;
  Model& model_;
  const VectorXd* counted_;
  std::vector<Parameter*> free_;
  double damping_ = kFirstDamping;
};

}  // namespace

void fit(const Likelihood& likelihood, Model& model, const VectorXd* counted) {
  if (!model.free().empty()) Fit(likelihood, model, counted).run();
}

void judge(const Likelihood& likelihood, double cost, Model& model) {
  const Linearised at = linearise(likelihood, model);
  const std::vector<const Parameter*> free = std::as_const(model).free();
  const auto count = static_cast<Index>(free.size());
  const MatrixXd inverse = at.curvature.ldlt().solve(MatrixXd::Identity(count, count));
  const MatrixXd scores = score_covariance(likelihood, at);
  const MatrixXd priors = prior_curvature(free, likelihood.dispersion());
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
  std::size_t place = 0;
  for (std::size_t n = 0; n < model.numbers.size(); ++n) {
    if (model.numbers[n].held) continue;
    if (model.numbers[n].in_plant && !opened.contains(n)) places.push_back(place);
    ++place;
  }
  for (auto n = least_certain(places, off, covariance); n;
       n = least_certain(places, off, covariance)) {
    // The others go on as if it were known: conditional mean and covariance of a normal.
    const auto i = static_cast<Index>(places[*n]);
    const VectorXd gain = covariance.col(i) / covariance(i, i);
    off -= gain * off[i];
    covariance -= gain * covariance.row(i).eval();
    free[places[*n]]->hold_at_plant();
    places.erase(places.begin() + static_cast<std::ptrdiff_t>(*n));
  }
  fit(likelihood, model);
}

}  // namespace ravencal::diagnose
