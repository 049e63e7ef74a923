// SPDX-License-Identifier: Apache-2.0
//
// Tries a suggested recording on the digital twin: simulates the motion with the improved plant and
// with the plant as it is, and diagnoses both.
#pragma once

#include <cstdint>
#include <functional>

#include "core/result.hpp"
#include "diagnose/report/suggest.hpp"
#include "physics/plant.hpp"

namespace ravencal::commands {

struct PredictedPower {
  int repetitions = 0;
  int parted = 0;            ///< named, and not tied to its rival, where the plant has the effect
  int named_anyway = 0;      ///< named where it has not
  int testable = 0;          ///< the effect could be looked for
  bool with_effect = false;  ///< the improved plant has the effect; else only `testable` counts
};

/// True if the twin can make this motion.
bool can_try(const diagnose::Suggestion& suggestion, const physics::Plant& plant);

/// `nominal`: the plant that was diagnosed; `improved`: with what was found. `look` returns false
/// to stop. Errors: the twin cannot run a plant (kData), stopped (kUsage).
core::Result<PredictedPower> predict_power(const diagnose::Suggestion& suggestion,
                                           const physics::Plant& nominal,
                                           const physics::Plant& improved, int repetitions,
                                           std::uint64_t seed, const std::function<bool()>& look);

}  // namespace ravencal::commands
