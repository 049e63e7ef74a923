// SPDX-License-Identifier: Apache-2.0
//
// How likely each effect of a model is, over the models that the search preferred it to and those
// that differ from it by one effect: without it, or with another candidate in its place. Weights of
// the models are pseudo-BMA+ (Yao, Vehtari, Simpson, Gelman, Bayesian Analysis 2018): held-out
// errors by block are the likelihood, the costs of score.cpp the prior, and a Bayesian bootstrap
// over blocks (Rubin 1981) keeps a few blocks from deciding more than they know.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// One id that may stand in an effect's place, and how likely it is given that something does.
struct InPlace {
  std::string id;
  double probability = 0.0;
};

struct EffectPosterior {
  /// That the effect is there, in [0, 1].
  double probability = 1.0;
  /// Of those in its place, the effect's own id aside; likeliest first.
  std::vector<InPlace> others;
  /// Of the effect's own id in that place.
  double in_place = 1.0;

  /// The fewest others that with the effect itself hold `mass` of the probability in its place.
  [[nodiscard]] std::vector<std::string> credible_others(double mass) const;
};

/// A model that may be the true one, with an id in the place in question.
struct Alternative {
  std::string id;           ///< empty: nothing stands there
  Eigen::VectorXd errors;   ///< held-out squared error by block
  double cost = 0.0;        ///< twice the negative log of the prior
  double form_error = 0.0;  ///< squared error by which simulations of the same physics differ
};
Alternative alternative_of(const ChannelModel& model, std::string id);

/// Of the first alternative's id, which others may have as well; `same`: ids that make the same
/// columns, which share its weight. `unit`: squared error that counts as one (noise_unit).
EffectPosterior weigh(const std::vector<Alternative>& alternatives,
                      const std::vector<std::string>& same, double unit, std::uint64_t seed);

/// For the model's chosen effect; `coefficients` are the model's.
EffectPosterior posterior_of(const ChannelModel& model, const Eigen::VectorXd& coefficients,
                             std::size_t chosen, const Gates& gates, std::uint64_t seed);

/// For the model's step, which `id` names; `same`: ids that make the same step.
EffectPosterior posterior_of_step(const ChannelModel& model, std::size_t step,
                                  const std::string& id, const std::vector<std::string>& same,
                                  std::uint64_t seed);

/// For the model's constant, which `form` names.
EffectPosterior posterior_of_constant(const ChannelModel& model, const EffectForm& form,
                                      const Gates& gates, std::uint64_t seed);

/// Greatest probability that chance at such a p-value leaves to an effect of one number (Sellke,
/// Bayarri, Berger, The American Statistician 2001), its prior as in a search.
double probability_at(double p_value);

}  // namespace ravencal::diagnose
