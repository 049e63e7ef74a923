// SPDX-License-Identifier: Apache-2.0
//
// Any plant along a recording of its robot: one joint or seven, with drive or with positions only.
// The input is what commanded the robot (desired positions, efforts, estimated positions, loads);
// the output has the same channels, so that the result can be compared with the recording
// (`ravencal diagnose --simulated`). A motion of one's own: session.hpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::simulation {

struct FollowOptions {
  /// Time after which a drive under recorded efforts restarts from the recorded state, because no
  /// controller bounds its error. Not used where the plant's controller closes the loop. > 0.
  double restart_s = 1.0;
  /// Take recorded efforts even where the plant has a controller and desired positions are known.
  bool open_loop = false;
};

/// How a joint was simulated.
struct FollowedJoint {
  std::string joint;
  std::string how;       ///< a few words for people
  double rmse_ji = 0.0;  ///< of the simulated position against the recorded one, rad or m
  /// Recorded minus simulated position in the mean, where the plant draws a constant at homing: no
  /// error of the simulation, and no part of `rmse_ji`.
  std::optional<double> drawn_constant_ji{};
};

struct FollowResult {
  record::Recording recording;
  std::vector<FollowedJoint> joints;
};

/// Errors (kData): no joint of the plant has what is needed in the recording.
core::Result<FollowResult> follow_recording(const physics::Plant& plant,
                                            const record::Recording& recording,
                                            const FollowOptions& options);

}  // namespace ravencal::simulation
