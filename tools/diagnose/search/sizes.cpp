// SPDX-License-Identifier: Apache-2.0
//
// How much one model of a search explains beside another, and how certain that is.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnose/findings/policy.hpp"
#include "diagnose/search/search.hpp"

namespace ravencal::diagnose {

using Eigen::VectorXd;

/// Blocks as observations.
double Search::gain_z(const Model& richer, const Model& poorer) const {
  const auto innovations = [&](const Model& model) {
    const State state = model.state_for(training_);
    return training_.whitened(training_.residuals(state, training_.outcome(state)));
  };
  const VectorXd with_it = innovations(richer);
  const VectorXd without_it = innovations(poorer);
  VectorXd gains = VectorXd::Zero(training_.block_count());
  for (Eigen::Index i = 0; i < with_it.size(); ++i)
    gains[training_.blocks()[static_cast<std::size_t>(i)]] +=
        huber_loss(without_it[i]) - huber_loss(with_it[i]);
  const double mean = gains.mean();
  const double squares = (gains.array() - mean).square().sum();
  const auto blocks = static_cast<double>(gains.size());
  return squares > 0.0 ? mean / std::sqrt(squares / (blocks * (blocks - 1.0))) : 0.0;
}

double Search::size_between(const Model& richer, const Model& other) const {
  const VectorXd sizes = sizes_between(richer, other);
  return sizes.size() > 0 ? sizes.maxCoeff() : 0.0;
}

/// In each channel.
VectorXd Search::sizes_between(const Model& richer, const Model& other) const {
  VectorXd sizes = VectorXd::Zero(static_cast<Eigen::Index>(training_.channels().size()));
  for (const Likelihood* likelihood :
       {static_cast<const Likelihood*>(&training_), static_cast<const Likelihood*>(held_out_)}) {
    if (likelihood == nullptr) continue;
    const bool own = likelihood == &training_;
    const State a = own ? richer.state_for(training_) : richer.state_elsewhere(*likelihood);
    const State b = own ? other.state_for(training_) : other.state_elsewhere(*likelihood);
    const auto left_a = likelihood->residuals(a, likelihood->outcome(a));
    const auto left_b = likelihood->residuals(b, likelihood->outcome(b));
    for (std::size_t c = 0; c < likelihood->channels().size(); ++c) {
      double squares = 0.0, left = 0.0;
      for (std::size_t r = 0; r < left_a[c].size(); ++r) {
        const std::vector<Eigen::Index>& used = likelihood->channels()[c].used[r];
        squares += (left_a[c][r] - left_b[c][r])(used).squaredNorm();
        left += left_a[c][r](used).squaredNorm();
      }
      double& size = sizes[static_cast<Eigen::Index>(c)];
      if (left > 0.0) size = std::max(size, std::sqrt(squares / left));
    }
  }
  return sizes;
}

/// Of what holds or does not, in the rows where it acts: RMS in floors of the channel; nothing
/// where it acts nearly always.
double Search::acting_size(const Model& model, std::size_t presence) const {
  Model absent = model;
  absent.effects.at(presence).front().x = 0.0;
  const State a = model.state_for(training_);
  const State b = absent.state_for(training_);
  const auto left_a = training_.residuals(a, training_.outcome(a));
  const auto left_b = training_.residuals(b, training_.outcome(b));
  double greatest = 0.0;
  for (std::size_t c = 0; c < training_.channels().size(); ++c) {
    double squares = 0.0, acting = 0.0, rows = 0.0;
    for (std::size_t r = 0; r < left_a[c].size(); ++r) {
      const std::vector<Eigen::Index>& used = training_.channels()[c].used[r];
      const VectorXd change = (left_a[c][r] - left_b[c][r])(used);
      squares += change.squaredNorm();
      acting += static_cast<double>((change.array() != 0.0).count());
      rows += static_cast<double>(used.size());
    }
    if (acting > 0.0 && acting < kMostLimited * rows)
      greatest = std::max(greatest, std::sqrt(squares / acting) / training_.channels()[c].floor);
  }
  return greatest;
}

/// Of what the candidate adds, by its interval.
double Search::size_z(const Model& model, std::size_t candidate) const {
  const Candidate& added = vocabulary_.candidates[candidate];
  const std::vector<const Parameter*> free = model.free();
  std::vector<Eigen::Index> places;
  const auto add = [&](const Parameter& wanted) {
    for (std::size_t k = 0; k < free.size(); ++k)
      if (free[k] == &wanted) places.push_back(static_cast<Eigen::Index>(k));
  };
  if (added.opens) {
    add(model.numbers[*added.opens]);
  } else {
    const std::vector<Parameter>& parameters = model.effects.at(candidate);
    for (std::size_t a = 0; a < added.sizes.size(); ++a) add(parameters[a]);
  }
  VectorXd off(static_cast<Eigen::Index>(places.size()));
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Parameter& p = *free[static_cast<std::size_t>(places[n])];
    off[static_cast<Eigen::Index>(n)] = p.x - p.mean;
  }
  const Eigen::MatrixXd covariance = model.judgement.covariance(places, places);
  return std::sqrt(std::max(0.0, off.dot(covariance.ldlt().solve(off))));
}

}  // namespace ravencal::diagnose
