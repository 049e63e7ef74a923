// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace ravencal::model {

/// The RMSE of one output on one recording, and the 95 % interval of it, SI.
struct ExpectedRmse {
  double rmse = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// What training expects of one output on another recording of the same arm.
struct ExpectedError {
  /// With the constant of the homing, as where the robot was not homed since the training.
  ExpectedRmse same_homing;
  /// After another homing, whose constant no input tells; nothing where the training has one
  /// homing.
  std::optional<ExpectedRmse> other_homing;
  double about_mean = 0.0;  ///< the RMSE with the recording's mean error taken off, SI

  /// Of a recording of which nothing more is known.
  [[nodiscard]] const ExpectedRmse& any() const {
    return other_homing ? *other_homing : same_homing;
  }
};

}  // namespace ravencal::model
