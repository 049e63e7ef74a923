// SPDX-License-Identifier: Apache-2.0
//
// A model: which candidates are in it, where its parameters are, and what it scores.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "diagnose/model/parameter.hpp"

namespace ravencal::diagnose {

struct Judgement {
  double loss = 0.0;        ///< Huber's, of the training rows
  double trace = 0.0;       ///< parameters that the data choose: trace of H^-1 times the scores'
                            ///< covariance
  double dispersion = 1.0;  ///< of the loss: correlation that the noise model leaves, at least 1
  double penalty = 0.0;     ///< of priors, effects and parameters
  double score = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd covariance;  ///< of x, in the order of Model::free()

  /// The score at another dispersion than that by which it was judged.
  [[nodiscard]] double score_at(double other) const {
    return (loss + 2.0 * trace) / other + penalty;
  }
};

struct Model {
  std::set<std::size_t> chosen;                           ///< places in the vocabulary
  std::vector<Parameter> numbers;                         ///< of the plant and the recordings
  std::map<std::size_t, std::vector<Parameter>> effects;  ///< of what is chosen
  Judgement judgement;

  /// Parameters that are fitted: numbers first, then those of the effects in their order.
  [[nodiscard]] std::vector<Parameter*> free();
  [[nodiscard]] std::vector<const Parameter*> free() const;
  [[nodiscard]] double prior() const;
  /// What the model says of the recordings of the likelihood that it was fitted to.
  [[nodiscard]] State state_for(const Likelihood& training) const;
  /// The same of other recordings, which have circumstances of their own.
  [[nodiscard]] State state_elsewhere(const Likelihood& other) const;
};

/// The likelihood linearised where a model is.
struct Linearised {
  State state;
  Outcome outcome;
  Eigen::VectorXd innovations;   ///< stacked
  Eigen::VectorXd root_weights;  ///< of Huber's loss
  Eigen::MatrixXd columns;       ///< change of the whitened prediction per change of x
  Eigen::MatrixXd curvature;     ///< weighted columns' products and the priors'
};

/// `counted`: 1 for each stacked row that counts and 0 for the others; null: all count.
Linearised linearise(const Likelihood& likelihood, const Model& model,
                     const Eigen::VectorXd* counted = nullptr);

/// Moves the model to the optimum of what a score tells apart, within its bounds: the loss of the
/// rows that count over the dispersion, and the priors.
void fit(const Likelihood& likelihood, Model& model, const Eigen::VectorXd* counted = nullptr);

/// Numbers of the plant that the rows move by no more than chance (5 %, the least certain one
/// first) are held at the plant's values, the others are fitted again. `opened`: places of numbers
/// that are named.
void hold_uncertain(const Likelihood& likelihood, const std::set<std::size_t>& opened,
                    Model& model);

/// Fills in the judgement of a fitted model. `cost`: of what is chosen, beside the priors.
void judge(const Likelihood& likelihood, double cost, Model& model);

}  // namespace ravencal::diagnose
