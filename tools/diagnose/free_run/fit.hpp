// SPDX-License-Identifier: Apache-2.0
//
// Refits the numbers of one joint's drive together, in free run: Ceres on jets, several starts,
// windows as observations. Nominal numbers stay within their tolerance, with it as prior; named
// effects are free within half and double. Intervals by bootstrap over windows.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "diagnose/free_run/free_run.hpp"

namespace ravencal::diagnose {

struct DriveHandle {
  physics::DriveField field = physics::DriveField::kOffset;
  std::string id, parameter;  ///< as in the report; empty for the offset
  double value = 0.0;         ///< where the fit starts
  double scale = 1.0;         ///< signed numbers: value + scale x; positive ones: value exp(x)
  bool positive = true;
  double centre = 0.0;  ///< x of the plant's own number
  double prior = 1.0;   ///< deviation of x from there
  double bound = 0.7;   ///< of |x - centre|

  [[nodiscard]] double at(double x) const;
};

struct DriveFit {
  std::vector<DriveHandle> handles;
  std::vector<double> x;                  ///< one per handle
  physics::DriveNumbers<double> numbers;  ///< at x
  /// RMS over windows that the deciding fit did not see, at the start and fitted on the others.
  double judged_before = -1.0;
  double judged_after = -1.0;
  /// Mean square over each of those windows, of the better of the two.
  Eigen::VectorXd judged_windows;
  Eigen::MatrixXd draws;  ///< of x, [bootstrap draws][handles]; empty if nothing was fitted

  /// The fit is worth adopting: better by 1 % on windows that it did not see.
  [[nodiscard]] bool better() const {
    return judged_before > 0.0 && judged_after < 0.99 * judged_before;
  }
};

/// Handles of the drive with these numbers. `named`: parameters ("id.parameter") that are free;
/// others keep within the joint's tolerance of the `nominal` numbers.
std::vector<DriveHandle> drive_handles(const physics::DriveNumbers<double>& numbers,
                                       const physics::DriveNumbers<double>& nominal,
                                       const physics::Joint& joint, bool has_weight,
                                       const std::vector<std::string>& named);

DriveFit fit_drive(const FreeRun& run, const physics::DriveNumbers<double>& start,
                   std::vector<DriveHandle> handles, std::uint64_t seed);

}  // namespace ravencal::diagnose
