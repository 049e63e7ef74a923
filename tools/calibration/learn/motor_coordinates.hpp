// SPDX-License-Identifier: Apache-2.0
//
// Whether the joints of a RAVEN-II's recording are those of its motors, or hold a correction. The
// controller computes jpos from mpos by its cable coupling, which is linear and has no constant.
#pragma once

#include "model/kinds.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

struct MotorCoordinates {
  model::Coordinates coordinates = model::Coordinates::kUnknown;
  /// What the motors leave of jpos at most: rad; of the insertion, 0.1 m count as 1 rad.
  double unexplained_rad = 0.0;
};

/// By the catalogue's channels jpos and mpos of joints 1 to 3. kUnknown: one of them is missing, or
/// the joints moved too little to tell. No coupling is assumed: it is fitted to the recording.
MotorCoordinates motor_coordinates(const record::Recording& recording);

}  // namespace ravencal::learn
