// SPDX-License-Identifier: Apache-2.0
//
// What the plant predicts in a residual channel, and how uncertain it is: every nominal parameter
// stays in each fit as a relative change with its tolerance as prior deviation, so that a plant
// that is off within its tolerance is no finding.
#pragma once

#include <string>
#include <vector>

#include "diagnose/series/series.hpp"
#include "physics/joint_error.hpp"
#include "physics/plant.hpp"
#include "physics/tolerance_keys.hpp"

namespace ravencal::diagnose {

struct NominalTerm {
  std::string id;         ///< vocabulary id that the parameter belongs to
  std::string parameter;  ///< as in the plant, without unit
  std::string unit;
  double value = 0.0;
  double tolerance = 0.1;  ///< relative: how far the parameter may be off
  Eigen::VectorXd column;  ///< change of the residual per relative change of the parameter
  /// Form of the simulation rather than a number of the plant (how a friction edge is rounded, how
  /// streams are stamped): never named, whatever its refitted value.
  bool form_only = false;
  std::string from = {};          ///< the other joint, for couplings
  double variation = 0.0;         ///< relative deviation over time that the plant admits
  bool beyond_is_effect = false;  ///< beyond its tolerance it is what the effect's own form means

  /// Makes it a form with that relative deviation.
  void be_form(double deviation) {
    form_only = true;
    tolerance = deviation;
  }
};

struct Nominal {
  Eigen::VectorXd prediction;  ///< of the residual, [rows]
  std::vector<NominalTerm> terms;
};

/// Prediction of the plant for this series. Effects that act on recorded motion through a cable
/// (compliance, joint friction, hysteresis, creep, backlash) are computed together,
/// quasi-statically.
Nominal nominal_of(const Series& series, const physics::Plant& plant);

/// What the plant's effects of this joint may depend on.
physics::JointSignals signals_of(const Series& series);

/// True if the plant has this effect on this joint, so that it cannot be "left out".
bool plant_has(const physics::Plant& plant, const std::string& joint, const std::string& id,
               const std::string& from);

}  // namespace ravencal::diagnose
