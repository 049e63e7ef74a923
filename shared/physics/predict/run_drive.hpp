// SPDX-License-Identifier: Apache-2.0
//
// One joint's drive on its own along a recording (drive_model.hpp): from a recorded state on it
// moves under the recorded effort, or under the controller's law that follows the recorded desired
// position. Nothing measured comes in on the way but efforts that the joint does not govern. Units
// of the joint, one value per row.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "physics/drive_model.hpp"
#include "physics/plant.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::physics {

/// Effort that holds what hangs on the drive.
struct DriveLoad {
  Eigen::VectorXd recorded;         ///< along the recording; none where empty or not finite
  double sine = 0.0, cosine = 0.0;  ///< of the simulated position

  [[nodiscard]] double at(double position, Eigen::Index row) const;
};

/// Weight of a robot that is one pendulum: it follows the simulated position. None for other
/// plants, and where a sensor measures loads from outside.
std::optional<DriveLoad> pendulum_load(const Plant& plant);

/// A drive that can run.
struct RunningDrive {
  DriveNumbers<double> numbers;
  DriveLoad load;
  double effort_limit = 0.0;    ///< 0: none
  std::optional<ServoLaw> law;  ///< closes the loop; without it recorded efforts drive
  double longest_step_s = 1e-3;

  [[nodiscard]] double limited(double effort) const;
};

/// What was recorded of the drive.
struct DriveSignals {
  Eigen::VectorXd t_s;
  Eigen::VectorXd position, velocity;  ///< where runs start
  Eigen::VectorXd bristle;             ///< DriveState::bristle where runs start
  Eigen::VectorXd effort;              ///< asked of the drive; not read where a law is
  Eigen::VectorXd desired;             ///< position; read where a law is
  std::vector<char> off;               ///< 1 where the drive was switched off; empty: nowhere
};

/// What the drive did. Velocity is the one that the law saw, effort what it asked for.
struct DriveRun {
  Eigen::VectorXd position, velocity, effort;
};

/// Runs from the recorded state of row `first` and writes rows [first, last) of `out`, efforts only
/// under a law and only of rows that another one follows. Returns the row from which on the
/// position is not finite, or `last`.
Eigen::Index run_drive(const RunningDrive& drive, const DriveSignals& signals, Eigen::Index first,
                       Eigen::Index last, DriveRun& out);

}  // namespace ravencal::physics
