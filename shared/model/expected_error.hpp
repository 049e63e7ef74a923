// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::model {

/// The RMSE that training expects of one output on another recording of the same arm, SI.
struct ExpectedError {
  double rmse = 0.0;
  double low = 0.0;  ///< 95 % interval of the RMSE of one recording
  double high = 0.0;
  double about_mean = 0.0;  ///< the RMSE with the recording's mean error taken off
};

}  // namespace ravencal::model
