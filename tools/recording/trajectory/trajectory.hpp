// SPDX-License-Identifier: Apache-2.0
//
// Joint trajectories for calibration and test runs of RAVEN-II, after the authors' generators
// (HaonanPeng/raven2_CRTK_Python_controller). All positions stay within the given limits.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::trajectory {

/// Desired joints over time. t_s rises strictly; the first is 0.
struct Trajectory {
  std::vector<double> t_s;
  std::vector<Eigen::Vector3d> joints_ji;  ///< rad, rad, m

  [[nodiscard]] double duration_s() const { return t_s.empty() ? 0.0 : t_s.back(); }
  /// Linear between samples; held before the first and after the last.
  [[nodiscard]] Eigen::Vector3d at(double t) const;
};

inline constexpr double kSampleRateHz = 100.0;

/// Errors (kUsage): a pace, of any trajectory, that is not in 0.1 to 10.
core::Status check_pace(double pace);

/// Range that a trajectory may use.
struct JointLimits {
  Eigen::Vector3d low_ji;
  Eigen::Vector3d high_ji;
};

/// The authors' workspace: 20..60 deg, 55..110 deg, 0.33..0.42 m.
JointLimits default_limits();

/// Direction of the zig-zag's long sweeps, in joint space.
enum class ZigzagKind { kX, kY, kZ, kXy, kYz, kXz, kXyz };
core::Result<ZigzagKind> zigzag_kind_from(std::string_view name);

/// A zig-zag through a cube: full sweeps along one edge, a step of `sparsity` along the second edge
/// after each, a step along the third after each layer. The cube has 1/sqrt(3) of the joint ranges
/// as edges and is turned so that the sweeps run along `kind`; its corners stay within the ranges.
struct ZigzagOptions {
  ZigzagKind kind = ZigzagKind::kYz;  ///< the authors' training files
  int divisions = 3;                  ///< sparsity is 1/divisions; 1 to 100
  double pace = 1.0;                  ///< times the speed limits of the authors' follower
  JointLimits limits = default_limits();
};
core::Result<Trajectory> make_zigzag(const ZigzagOptions& options);

enum class RandomMode {
  kPaper,  ///< half cosines between random turning points with random speed ("sinusoidal cycles")
  kCode,   ///< what the authors' script does: constant random speed, ramp after each turning point
};

/// Random motion for tests: every joint on its own between a low and a high random turning point.
struct RandomOptions {
  RandomMode mode = RandomMode::kPaper;
  double duration_s = 600.0;
  std::uint64_t seed = 1;
  double pace = 1.0;  ///< times the authors' speeds
};
core::Result<Trajectory> make_random(const RandomOptions& options);

/// CSV with header `t_s,shoulder_rad,elbow_rad,insertion_m`.
core::Status write_csv(const Trajectory& trajectory, const std::filesystem::path& path,
                       bool overwrite);
core::Result<Trajectory> read_csv(const std::filesystem::path& path);

}  // namespace ravencal::trajectory
