// SPDX-License-Identifier: Apache-2.0
//
// Joint trajectories for calibration and test runs, of a plant with any number of joints. Those of
// RAVEN-II are after the authors' generators (HaonanPeng/raven2_CRTK_Python_controller). All
// positions stay within the given limits.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::trajectory {

/// A joint as a trajectory knows it.
struct MovedJoint {
  std::string name;
  physics::JointKind kind = physics::JointKind::kRevolute;

  bool operator==(const MovedJoint&) const = default;
};
/// The joints of a RAVEN arm that the authors move: shoulder, elbow, insertion.
std::vector<MovedJoint> raven_joints();
std::vector<MovedJoint> joints_of(const physics::Plant& plant);

/// Desired joints over time. t_s rises strictly; the first is 0.
struct Trajectory {
  std::vector<MovedJoint> joints = raven_joints();
  std::vector<double> t_s{};
  std::vector<Eigen::VectorXd> joints_ji{};  ///< [rows][joints], rad or m

  [[nodiscard]] double duration_s() const { return t_s.empty() ? 0.0 : t_s.back(); }
  /// Linear between samples; held before the first and after the last.
  [[nodiscard]] Eigen::VectorXd at(double t) const;
};

inline constexpr double kSampleRateHz = 100.0;

/// Errors (kUsage): a pace, of any trajectory, that is not in 0.1 to 10.
core::Status check_pace(double pace);

/// Range that a trajectory may use, [joints].
struct JointLimits {
  std::vector<MovedJoint> joints;
  Eigen::VectorXd low_ji, high_ji;  ///< rad or m
  Eigen::VectorXd fastest_ji;       ///< rad/s or m/s
};

/// The authors' workspace and the speeds of their follower (run_r2_trajectory_follow.py): 20..60
/// deg, 55..110 deg, 0.33..0.42 m; 2.182 deg/s, 3 deg/s, 5 mm/s.
JointLimits authors_workspace();

/// What the plant states. Errors (kData): a joint without limits, by its name.
core::Result<JointLimits> limits_of(const physics::Plant& plant);

/// Direction of the zig-zag's long sweeps, in the joint space of three joints.
enum class ZigzagKind { kX, kY, kZ, kXy, kYz, kXz, kXyz };
core::Result<ZigzagKind> zigzag_kind_from(std::string_view name);

/// Three joints: a zig-zag through a cube, full sweeps along one edge, a step of `sparsity` along
/// the second edge after each, a step along the third after each layer. The cube has 1/sqrt(3) of
/// the joint ranges as edges and is turned so that the sweeps run along `kind`; its corners stay
/// within the ranges. Any other number: each joint in turn sweeps its whole range, the one behind
/// it steps, the one behind that moves from layer to layer, and the rest stand in their middles.
struct ZigzagOptions {
  ZigzagKind kind = ZigzagKind::kYz;  ///< the authors' training files; of three joints
  int divisions = 3;                  ///< sparsity is 1/divisions; 1 to 100
  double pace = 1.0;                  ///< times the speeds of the limits
  JointLimits limits = authors_workspace();
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
  double pace = 1.0;                    ///< times the authors' speeds, or those of the limits
  std::optional<JointLimits> limits{};  ///< absent: the authors' bands of turning points
};
core::Result<Trajectory> make_random(const RandomOptions& options);

/// CSV with header `t_s` and NAME_rad or NAME_m of each joint. Errors: those of
/// core::write_whole_file; a name that no header can hold (kData).
core::Status write_csv(const Trajectory& trajectory, const std::filesystem::path& path);
core::Result<Trajectory> read_csv(const std::filesystem::path& path);

/// The trajectory in the order of `joints`, which are those of `whose`. `source` stands for the
/// trajectory in messages. Errors (kData): it moves others, or one of them in another unit.
core::Result<Trajectory> in_order(Trajectory trajectory, const std::vector<MovedJoint>& joints,
                                  const std::string& source, const std::string& whose);

/// The trajectory of a file, in the plant's order and within what the plant states of its joints'
/// travel and speed. Errors (kData) name line, joint, value and limit.
core::Result<Trajectory> read_for_plant(const std::filesystem::path& path,
                                        const physics::Plant& plant);
/// The same check of one that is in the plant's order.
core::Status check_limits(const Trajectory& trajectory, const physics::Plant& plant,
                          const std::string& source);

}  // namespace ravencal::trajectory
