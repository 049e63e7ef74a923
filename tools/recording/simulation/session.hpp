// SPDX-License-Identifier: Apache-2.0
//
// One recording session of a simulated plant along a trajectory. The digital twin of a RAVEN arm
// homes, moves to the start, follows the trajectory, and writes the messages of the robot and its
// external encoders. Other plants: any_arm.hpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::simulation {

struct SessionOptions {
  std::uint64_t seed = 1;
  std::uint64_t homing_seed = 1;
  std::optional<double> rate_hz;  ///< rows per second; the plant's logger rate if absent
  double rehome_every_s = 0.0;    ///< 0: only at the start
  std::uint32_t rehomings = 0;    ///< homes so many times more before recording starts
  bool drift = false;
  bool overwrite = false;
  std::string trajectory_name;  ///< for the recording's metadata
  /// Records every edge of the external encoders here, as `ravencal-encoders --edges` does, on a
  /// clock of its own. The robot's recording then has no truth: it has to be merged in.
  std::optional<std::filesystem::path> edges;
  /// Told the true joints, [3] rad rad m, at every control cycle, homing included.
  std::function<void(std::int64_t t_ns, const Eigen::Vector3d& joints_ji)> on_truth;
};

struct SessionSummary {
  std::int64_t rows = 0;
  int homings = 0;
  double simulated_s = 0.0;  ///< homing included
  bool interrupted = false;
  /// Joints that the simulation led by a servo of its own, since the plant states none.
  std::vector<std::string> led{};
};

/// True if the digital twin can run the plant: three joints with servo and homing.
bool simulation_runs(const physics::Plant& plant);
/// kUsage with what the twin runs, where it cannot run the plant.
core::Status check_simulation_runs(const physics::Plant& plant);

/// Told the share done, in [0, 1]; returns false to stop early.
using ProgressFunction = std::function<bool(double)>;

/// `trajectory` is in the plant's order of joints. Records into `out`, which appears when it is
/// whole. Stopped early, it ends with the event `interrupted`, and replaces no file. Errors: kUsage
/// for names that are taken and rates that do not fit, kData for a plant that cannot home, kIo.
core::Result<SessionSummary> record_session(const physics::Plant& plant,
                                            const trajectory::Trajectory& trajectory,
                                            const std::filesystem::path& out,
                                            const SessionOptions& options,
                                            const ProgressFunction& progress);

}  // namespace ravencal::simulation
