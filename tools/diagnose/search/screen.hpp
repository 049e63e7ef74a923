// SPDX-License-Identifier: Apache-2.0
//
// Which candidates would the data rather have? A score test of everything that a model lacks, at
// its optimum: what is left against what a candidate would change, less what the model's own
// parameters (and their priors) can make of it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "diagnose/model/model.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"

namespace ravencal::diagnose {

struct Hit {
  std::size_t candidate = 0;
  std::size_t start = 0;   ///< which of its starts
  double gain = 0.0;       ///< of the loss, to first order
  double statistic = 0.0;  ///< sum of the blocks' scores in deviations, squared
  double p_value = 1.0;    ///< chance of the statistic over all candidates
  Eigen::VectorXd sizes;   ///< x of the candidate's sizes
};

/// The best start of each candidate, the greatest gain first. Chance by flipping the signs of
/// blocks, maximum over the candidates (Romano and Wolf 2005). `joint`: of that one only.
std::vector<Hit> screen(const Likelihood& likelihood, const Model& model,
                        const Vocabulary& vocabulary, std::uint64_t seed,
                        std::optional<std::size_t> joint = {});

/// One candidate alone, without chance; nothing where no start fits.
std::vector<Hit> screen_one(const Likelihood& likelihood, const Model& model,
                            const Candidate& candidate);

/// How well the recordings tell of a candidate that the model lacks, at the start where they tell
/// least.
struct Resolution {
  std::size_t candidate = 0;
  std::size_t start = 0;
  double deviation = 0.0;  ///< of x of its first size, from the rows alone: no prior of it
  double own = 0.0;        ///< share of what it changes that nothing in the model can change
};
std::vector<Resolution> resolutions(const Likelihood& likelihood, const Model& model,
                                    const Vocabulary& vocabulary);

/// Gives jumps the moments, tones the frequencies and waves the orders at which the model leaves
/// most.
void aim(Likelihood& training, Likelihood* held_out, const Model& model, Vocabulary& vocabulary);

/// The model with the candidate at the hit's sizes; and without it and what cannot stand without
/// it.
Model with(const Model& model, const Vocabulary& vocabulary, const Hit& hit);
Model without(const Model& model, const Vocabulary& vocabulary, std::size_t candidate);

}  // namespace ravencal::diagnose
