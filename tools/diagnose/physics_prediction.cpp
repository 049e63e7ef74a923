// SPDX-License-Identifier: Apache-2.0
#include "diagnose/physics_prediction.hpp"

#include <fmt/format.h>

#include "diagnose/effects/nominal.hpp"
#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

core::Result<std::vector<PredictedError>> predict_errors(const record::Recording& recording,
                                                         const physics::Plant& plant) {
  SeriesOptions options;
  options.most_rows = std::max<Eigen::Index>(1, recording.rows());
  RAVENCAL_ASSIGN_OR_RETURN(const SeriesSet set, build_series({recording}, {}, plant, options));
  std::vector<PredictedError> predicted;
  for (const Series& series : set.series) {
    if (series.stage != Stage::kTransmission) continue;
    PredictedError own{series.joint, series.unit, nominal_of(series, plant).prediction};
    // An earlier joint's error arrives through the plant's coupling; here it is predicted, too.
    const std::size_t index = plant.joint_index(series.joint).value_or(0);
    for (const PredictedError& other : predicted) {
      const std::size_t from = plant.joint_index(other.joint).value_or(0);
      if (from < index) own.error += plant.coupling[index][from] * other.error;
    }
    predicted.push_back(std::move(own));
  }
  if (!predicted.empty()) return predicted;
  return core::Error{
      core::ErrorCode::kData,
      fmt::format("{}: no joint of the plant {} has both an estimate and a truth there",
                  recording.source, plant.source)};
}

}  // namespace ravencal::diagnose
