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

namespace {

constexpr int kPartsLeftOut = 4;

VectorXd innovations(const State& state, const Likelihood& rows) {
  auto residuals = rows.residuals(state, rows.outcome(state));
  take_drawn_constants(rows, residuals);
  return rows.whitened(residuals);
}

/// The plant and the laws of a model elsewhere: what a recorder adds (a late effort) is no part of
/// either.
State as_plant(const Model& model, const Likelihood& elsewhere) {
  State state = model.state_elsewhere(elsewhere);
  for (std::vector<physics::JointCircumstances>& joints : state.circumstances)
    for (physics::JointCircumstances& joint : joints)
      joint.effort_lateness_s = joint.truth_lateness_s = 0.0;
  return state;
}

/// Of the loss in each row.
VectorXd gains(const VectorXd& with_it, const VectorXd& without_it) {
  VectorXd out(with_it.size());
  for (Eigen::Index i = 0; i < out.size(); ++i)
    out[i] = huber_loss(without_it[i]) - huber_loss(with_it[i]);
  return out;
}

/// Of gains by block: what nearly all other blocks of this kind would give as well.
double least_sum(const VectorXd& of_blocks) {
  const auto blocks = static_cast<double>(of_blocks.size());
  const double squares = (of_blocks.array() - of_blocks.mean()).square().sum();
  return of_blocks.sum() - kLeastSize_z * std::sqrt(squares * blocks / std::max(1.0, blocks - 1.0));
}

}  // namespace

double Search::unseen_gain(const Model& richer, const Model& poorer) const {
  if (held_out_ != nullptr) {
    return gains(innovations(as_plant(richer, *held_out_), *held_out_),
                 innovations(as_plant(poorer, *held_out_), *held_out_))
               .sum() /
           dispersion();
  }
  const VectorXd of_rows = gains(innovations(richer.state_for(training_), training_),
                                 innovations(poorer.state_for(training_), training_));
  VectorXd of_blocks = VectorXd::Zero(training_.block_count());
  for (Eigen::Index i = 0; i < of_rows.size(); ++i)
    of_blocks[training_.blocks()[static_cast<std::size_t>(i)]] += of_rows[i];
  return least_sum(of_blocks) / dispersion();
}

/// Innovations forget what is slow; a plant must not buy them with errors that stay.
bool Search::pays(const Model& richer, const Model& poorer) const {
  if (unseen_gain(richer, poorer) < kLeastUnseenGain) return false;
  if (held_out_ == nullptr) return true;
  const auto error = [&](const Model& model) {
    const State state = as_plant(model, *held_out_);
    auto left = held_out_->residuals(state, held_out_->outcome(state));
    take_drawn_constants(*held_out_, left);
    double floors = 0.0;
    for (std::size_t c = 0; c < left.size(); ++c) {
      const Channel& channel = held_out_->channels()[c];
      for (std::size_t r = 0; r < left[c].size(); ++r)
        if (!channel.used[r].empty())
          floors += left[c][r](channel.used[r]).squaredNorm() / std::pow(channel.floor, 2);
    }
    return floors;
  };
  return error(richer) < error(poorer);
}

/// Over the dispersion: of parts of the recordings, each predicted by what the others say.
double Search::gain_left_out(const Model& richer, const Model& poorer) const {
  const auto part_of = [&](Eigen::Index row) {
    return training_.blocks()[static_cast<std::size_t>(row)] * kPartsLeftOut /
           std::max(1, training_.block_count());
  };
  double sum = 0.0;
  for (int part = 0; part < kPartsLeftOut; ++part) {
    VectorXd is_left_out(training_.rows());
    for (Eigen::Index i = 0; i < is_left_out.size(); ++i)
      is_left_out[i] = part_of(i) == part ? 1.0 : 0.0;
    const VectorXd counted = 1.0 - is_left_out.array();
    const auto predicted = [&](Model model) {
      fit(training_, model, &counted);
      return innovations(model.state_for(training_), training_);
    };
    sum += gains(predicted(richer), predicted(poorer)).dot(is_left_out);
  }
  return sum / dispersion();
}

namespace {

/// What distinguishes two states of one channel, summed over its rows.
struct Change {
  double squares = 0.0;  ///< of the change
  double acting = 0.0;   ///< rows that it changes
  double rows = 0.0;
  double left = 0.0;  ///< squares of what the first state leaves
};

std::vector<Change> changes(const Likelihood& likelihood, const State& of, const State& other) {
  const auto left = likelihood.residuals(of, likelihood.outcome(of));
  const auto left_by_other = likelihood.residuals(other, likelihood.outcome(other));
  std::vector<Change> out(likelihood.channels().size());
  for (std::size_t c = 0; c < out.size(); ++c) {
    for (std::size_t r = 0; r < left[c].size(); ++r) {
      const Channel& channel = likelihood.channels()[c];
      const std::vector<Eigen::Index>& used = channel.used[r];
      if (used.empty()) continue;
      const VectorXd change = (left[c][r] - left_by_other[c][r])(used);
      out[c].squares += change.squaredNorm();
      out[c].acting += static_cast<double>((change.array() != 0.0).count());
      out[c].rows += static_cast<double>(used.size());
      out[c].left += left[c][r](used).squaredNorm();
    }
  }
  return out;
}

}  // namespace

double Search::size_between(const Model& richer, const Model& other) const {
  const VectorXd sizes = sizes_between(richer, other);
  return sizes.size() > 0 ? sizes.maxCoeff() : 0.0;
}

/// In each channel.
VectorXd Search::sizes_between(const Model& richer, const Model& other) const {
  VectorXd sizes = VectorXd::Zero(static_cast<Eigen::Index>(training_.channels().size()));
  const auto add = [&](const std::vector<Change>& of) {
    for (std::size_t c = 0; c < of.size(); ++c) {
      double& size = sizes[static_cast<Eigen::Index>(c)];
      if (of[c].left > 0.0) size = std::max(size, std::sqrt(of[c].squares / of[c].left));
    }
  };
  add(changes(training_, richer.state_for(training_), other.state_for(training_)));
  if (held_out_ != nullptr)
    add(changes(*held_out_, richer.state_elsewhere(*held_out_), other.state_elsewhere(*held_out_)));
  return sizes;
}

/// Of what holds or does not, in the rows where it acts: RMS in floors of the channel; nothing
/// where it acts nearly always.
double Search::acting_size(const Model& model, std::size_t presence) const {
  Model absent = model;
  absent.effects.at(presence).front().x = 0.0;
  const std::vector<Change> of =
      changes(training_, model.state_for(training_), absent.state_for(training_));
  double greatest = 0.0;
  for (std::size_t c = 0; c < of.size(); ++c)
    if (of[c].acting > 0.0 && of[c].acting < kMostLimited * of[c].rows)
      greatest = std::max(greatest,
                          std::sqrt(of[c].squares / of[c].acting) / training_.channels()[c].floor);
  return greatest;
}

bool Search::certain(const Model& judged, const Model& written, std::size_t candidate) const {
  const Candidate& added = vocabulary_.candidates[candidate];
  const double least_z = added.is_presence()                  ? kLeastPresence_z
                         : added.kind == CandidateKind::kJump ? kLeastJumpSize_z
                                                              : kLeastSize_z;
  return size_z(judged, written, candidate) >= least_z;
}

double Search::size_z(const Model& judged, const Model& written, std::size_t candidate) const {
  const Candidate& added = vocabulary_.candidates[candidate];
  const auto sizes = [&](const Model& model) {
    std::vector<const Parameter*> out;
    if (added.opens) {
      out.push_back(&model.numbers[*added.opens]);
    } else {
      for (std::size_t a = 0; a < added.sizes.size(); ++a)
        out.push_back(&model.effects.at(candidate)[a]);
    }
    return out;
  };
  const std::vector<const Parameter*> free = judged.free(), wide = sizes(judged),
                                      said = sizes(written);
  std::vector<Eigen::Index> places;
  VectorXd off(static_cast<Eigen::Index>(said.size())), moved(off.size());
  for (std::size_t n = 0; n < said.size(); ++n) {
    const auto place = std::find(free.begin(), free.end(), wide[n]) - free.begin();
    places.push_back(static_cast<Eigen::Index>(place));
    off[static_cast<Eigen::Index>(n)] = said[n]->x - said[n]->mean;
    moved[static_cast<Eigen::Index>(n)] = said[n]->x - wide[n]->x;
  }
  const Eigen::MatrixXd covariance =
      judged.judgement.covariance(places, places) + moved * moved.transpose();
  return std::sqrt(std::max(0.0, off.dot(covariance.ldlt().solve(off))));
}

}  // namespace ravencal::diagnose
