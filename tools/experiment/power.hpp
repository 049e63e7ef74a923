// SPDX-License-Identifier: Apache-2.0
//
// Tries a suggested recording on the digital twin: simulates the motion with the improved plant and
// with the plant as it is, and diagnoses both.
#pragma once

#include <cstdint>
#include <functional>

#include "core/result.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/report/suggest.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::experiment {

struct PredictedPower {
  int repetitions = 0;
  int parted = 0;            ///< named, and not tied to its rival, where the plant has the effect
  int named_anyway = 0;      ///< named where it has not
  int testable = 0;          ///< the effect could be looked for
  bool with_effect = false;  ///< the improved plant has the effect; else only `testable` counts

  /// Information that such a recording is expected to give on whether the effect is there, bits:
  /// between `prior`, its probability so far, and what the repetitions answered, each rate with one
  /// answer of either kind added (Laplace's rule).
  [[nodiscard]] double information_bits(double prior) const;
};

/// An effect as the report knows it, to be drawn within what is not known of it.
struct ReportedEffect {
  std::string id, joint;
  double probability = 1.0;
  std::vector<diagnose::NamedParameter> parameters;
};
/// Errors: not such a report (kData).
core::Result<std::vector<ReportedEffect>> reported_effects(const std::string& report_json,
                                                           const std::string& source);

struct Trial {
  const physics::Plant& nominal;   ///< that was diagnosed
  const physics::Plant& improved;  ///< with what was found
  const std::vector<ReportedEffect>& reported;
  int repetitions = 3;
  std::uint64_t seed = 1;
  std::function<bool()> look;  ///< false stops
};

/// How often a recording of `motion` gives the answer that the suggestion asks for. Each repetition
/// draws the improved plant's effects anew from their intervals. Errors: the twin cannot run a
/// plant (kData), stopped (kUsage).
core::Result<PredictedPower> predict_power(const diagnose::Suggestion& suggestion,
                                           const trajectory::Trajectory& motion,
                                           const Trial& trial);

}  // namespace ravencal::experiment
