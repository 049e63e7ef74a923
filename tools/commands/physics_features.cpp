// SPDX-License-Identifier: Apache-2.0
#include "commands/physics_features.hpp"

#include "diagnose/physics_prediction.hpp"
#include "physics/plant.hpp"

namespace ravencal::commands {

core::Status add_physics(std::vector<record::Recording>& recordings, const std::string& plant_text,
                         const std::string& source) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::parse_plant(plant_text, source));
  for (record::Recording& recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const auto predicted, diagnose::predict_errors(recording, plant));
    const Eigen::Index first = recording.samples.cols();
    recording.samples.conservativeResize(Eigen::NoChange,
                                         first + static_cast<Eigen::Index>(predicted.size()));
    for (std::size_t k = 0; k < predicted.size(); ++k) {
      recording.channels.push_back(
          {kPhysicsPrefix + predicted[k].joint, predicted[k].unit, record::Role::kFeature, ""});
      recording.samples.col(first + static_cast<Eigen::Index>(k)) = predicted[k].error;
    }
  }
  return {};
}

core::Status add_physics_of(const model::CalibrationModel& model,
                            std::vector<record::Recording>& recordings) {
  const auto text = model.provenance.find(kPhysicsPlant);
  if (text == model.provenance.end()) return {};
  return add_physics(recordings, text->second, "the plant within the model");
}

}  // namespace ravencal::commands
