// SPDX-License-Identifier: Apache-2.0
//
// What a session of the twin shows of its joints, and by how much two sessions of one plant differ:
// the ruler against which the size of an effect is chosen.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::conceal {

/// Means over a quarter of a second, a column per joint, in the joint's units: what is faster is
/// noise of sampling.
struct Traces {
  Eigen::MatrixX3d position;  ///< as the controller believes it
  Eigen::MatrixX3d error;     ///< true joint minus believed one
  Eigen::MatrixX3d effort;    ///< that the controller asks of the drive
  double row_s = 0.0;
};

/// Records a session of the twin along the motion. `scratch` is the recording's file, which does
/// not stay. Errors: no RAVEN plant, the arm does not home (kData), the file (kIo).
core::Result<Traces> observe(const physics::Plant& plant, const trajectory::Trajectory& motion,
                             std::uint64_t seed, const std::filesystem::path& scratch);

/// RMS of a column about its mean.
double spread(const Eigen::VectorXd& column);

/// A plant in a motion, and the spread of what two sessions of it differ by, over root two.
struct Observed {
  Traces traces;
  Eigen::Vector3d error_scatter;
  Eigen::Vector3d effort_scatter;
};
core::Result<Observed> observe_scatter(const physics::Plant& plant,
                                       const trajectory::Trajectory& motion, std::uint64_t seed,
                                       const std::filesystem::path& scratch);

/// How much other traces of the same seed differ, as multiples of the scatter.
struct Visibility {
  double in_error = 0.0;
  double in_effort = 0.0;

  [[nodiscard]] bool by_error() const { return in_error >= in_effort; }
  [[nodiscard]] double most() const { return by_error() ? in_error : in_effort; }
};
Visibility visibility_at(std::size_t joint, const Observed& plain, const Traces& changed);

}  // namespace ravencal::conceal
