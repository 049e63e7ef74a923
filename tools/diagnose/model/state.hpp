// SPDX-License-Identifier: Apache-2.0
//
// What a model says: a plant, and what the recordings have beside it. The plant is the one that is
// written: nothing of a prediction stands anywhere else.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "physics/plant.hpp"
#include "physics/predict/predict.hpp"

namespace ravencal::diagnose {

/// What the command of a joint's law has beside the plant's controller.
struct LawCircumstances {
  double desired_rate = 1.0;  ///< share of the desired velocity that the damping knows of
  double age_s = 0.0;         ///< of the signals that the law sees
  double saturated = 1.0;     ///< share of what the plant's limit keeps back
};

struct State {
  physics::Plant plant;
  std::vector<std::vector<physics::JointCircumstances>> circumstances;  ///< [recording][joint]
  std::vector<LawCircumstances> laws;                                   ///< [joint]
  std::map<std::size_t, double> shapes;  ///< coefficient of each shape without a name
};

/// The plant as it is, along so many recordings.
State initial_state(const physics::Plant& plant, std::size_t recordings);

/// A parameter of an effect of the joint; the effect is added where the plant lacks it.
double plant_number(const physics::Plant& plant, std::size_t joint, const std::string& effect,
                    const std::string& parameter, const std::string& from = "");
void set_plant_number(physics::Plant& plant, std::size_t joint, const std::string& effect,
                      const std::string& parameter, double value, const std::string& from = "");

}  // namespace ravencal::diagnose
