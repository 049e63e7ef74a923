// SPDX-License-Identifier: Apache-2.0
//
// What the plant's numbers do when an effect joins them: evidence with all of them held anew.
#pragma once

#include <cstdint>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// What a candidate gains with the plant's numbers held anew beside it. A screen holds them where
/// they were without it, bent as far towards it as their tolerances let them.
Evidence anew(Evidence e, const Eigen::VectorXd& before, const Eigen::VectorXd& after, double rows,
              std::uint64_t seed);

/// True if the gain from errors `before` to `after` by block takes most of them, and still does
/// without the best block and its neighbours: a motion that shows an effect may come in too few
/// stretches for a test over blocks.
bool takes_most(const EffectForm& form, const Eigen::VectorXd& before, const Eigen::VectorXd& after,
                const Gates& gates);

/// The likeliest admissible candidate.
std::optional<Contender> pick(const ScreenResult& result, const ChannelModel& model,
                              const Gates& gates);

}  // namespace ravencal::diagnose
