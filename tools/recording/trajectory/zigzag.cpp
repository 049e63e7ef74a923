// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/constants.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::trajectory {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::array<std::string_view, 7> kKindNames = {"x", "y", "z", "xy", "yz", "xz", "xyz"};

/// The follower aims ahead of itself and cuts corners; a moving average over this time does the
/// same.
constexpr double kCornerS = 0.2;

/// Unit edges of the cube in joint space scaled to unit ranges: sweep, step, layer.
Matrix3d edges_of(ZigzagKind kind) {
  const double h = std::numbers::sqrt2 / 2.0;
  Matrix3d edges;
  switch (kind) {
    case ZigzagKind::kX:
      return Matrix3d::Identity();
    case ZigzagKind::kY:
      edges << 0, 0, 1, 1, 0, 0, 0, 1, 0;
      return edges;
    case ZigzagKind::kZ:
      edges << 0, 1, 0, 0, 0, 1, 1, 0, 0;
      return edges;
    case ZigzagKind::kXy:
      edges << h, -h, 0, h, h, 0, 0, 0, 1;
      return edges;
    case ZigzagKind::kYz:
      edges << 0, 0, 1, h, -h, 0, h, h, 0;
      return edges;
    case ZigzagKind::kXz:
      edges << h, -h, 0, 0, 0, 1, h, h, 0;
      return edges;
    case ZigzagKind::kXyz: {
      const Vector3d sweep = Vector3d::Ones().normalized();
      const Vector3d step = Vector3d(1.0, -1.0, 0.0).normalized();
      edges.col(0) = sweep;
      edges.col(1) = step;
      edges.col(2) = sweep.cross(step);
      return edges;
    }
  }
  return Matrix3d::Identity();
}

/// Corners of the zig-zag in the cube's own coordinates, each in [0, 1].
std::vector<Vector3d> snake_corners(int divisions) {
  std::vector<Vector3d> corners = {Vector3d::Zero()};
  Vector3d at = Vector3d::Zero();
  bool step_up = true;
  for (int layer = 0; layer <= divisions; ++layer) {
    for (int row = 0; row <= divisions; ++row) {
      at[0] = 1.0 - at[0];
      corners.push_back(at);
      if (row == divisions) break;
      at[1] = static_cast<double>(step_up ? row + 1 : divisions - row - 1) / divisions;
      corners.push_back(at);
    }
    step_up = !step_up;
    if (layer == divisions) break;
    at[2] = static_cast<double>(layer + 1) / divisions;
    corners.push_back(at);
  }
  return corners;
}

/// The turned cube of three joints, in joint space.
std::vector<VectorXd> corners_of_cube(const ZigzagOptions& options) {
  const Vector3d low = options.limits.low_ji, high = options.limits.high_ji;
  const Vector3d range = high - low;
  const Vector3d centre = 0.5 * (high + low);
  const Matrix3d edges = edges_of(options.kind) / std::numbers::sqrt3;
  std::vector<VectorXd> corners;
  for (const Vector3d& corner : snake_corners(options.divisions)) {
    corners.emplace_back(centre + range.cwiseProduct(edges * (corner - Vector3d::Constant(0.5))));
  }
  return corners;
}

/// Each joint's sweeps, in joint space. One joint alone goes to and fro; two have no layers.
std::vector<VectorXd> corners_of_sweeps(const ZigzagOptions& options) {
  const VectorXd& low = options.limits.low_ji;
  const VectorXd range = options.limits.high_ji - low;
  const Index joints = low.size(), edges = std::min<Index>(3, joints);
  std::vector<VectorXd> corners;
  for (Index sweeping = 0; sweeping < joints; ++sweeping) {
    for (const Vector3d& corner : snake_corners(options.divisions)) {
      if (edges < 3 && corner[2] > 0.0) break;
      VectorXd share = VectorXd::Constant(joints, 0.5);
      for (Index edge = 0; edge < edges; ++edge) share[(sweeping + edge) % joints] = corner[edge];
      corners.emplace_back(low + range.cwiseProduct(share));
    }
  }
  return corners;
}

/// Positions at kSampleRateHz along straight lines, each as fast as the slowest joint allows.
std::vector<VectorXd> follow(const std::vector<VectorXd>& corners, const VectorXd& fastest_ji) {
  std::vector<VectorXd> samples = {corners.front()};
  double clock_s = 0.0;
  double start_s = 0.0;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const VectorXd change = corners[i] - corners[i - 1];
    const double duration_s = change.cwiseAbs().cwiseQuotient(fastest_ji).maxCoeff();
    while (clock_s + 1.0 / kSampleRateHz <= start_s + duration_s) {
      clock_s += 1.0 / kSampleRateHz;
      samples.emplace_back(corners[i - 1] + change * ((clock_s - start_s) / duration_s));
    }
    start_s += duration_s;
  }
  return samples;
}

/// Centred moving average, shorter at the ends: stays within the hull of its input.
std::vector<VectorXd> round_corners(const std::vector<VectorXd>& samples) {
  const auto half = static_cast<std::size_t>(0.5 * kCornerS * kSampleRateHz);
  std::vector<VectorXd> rounded(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t reach = std::min({half, i, samples.size() - 1 - i});
    VectorXd sum = VectorXd::Zero(samples[i].size());
    for (std::size_t k = i - reach; k <= i + reach; ++k) sum += samples[k];
    rounded[i] = sum / static_cast<double>(2 * reach + 1);
  }
  return rounded;
}

core::Status check_range(const JointLimits& limits) {
  for (Index j = 0; j < limits.low_ji.size(); ++j) {
    const std::string& name = limits.joints[static_cast<std::size_t>(j)].name;
    if (!(limits.low_ji[j] < limits.high_ji[j]))
      return core::usage_error(
          fmt::format("joint {}: its lower limit {} must be below its upper "
                      "limit {}",
                      name, limits.low_ji[j], limits.high_ji[j]));
    if (!(limits.fastest_ji[j] > 0.0))
      return core::usage_error(
          fmt::format("joint {}: its speed {} must be above 0", name, limits.fastest_ji[j]));
  }
  return {};
}

}  // namespace

JointLimits authors_workspace() {
  return {raven_joints(), Vector3d(20.0 * core::kRadPerDeg, 55.0 * core::kRadPerDeg, 0.33),
          Vector3d(60.0 * core::kRadPerDeg, 110.0 * core::kRadPerDeg, 0.42),
          Vector3d(2.182 * core::kRadPerDeg, 3.0 * core::kRadPerDeg, 0.005)};
}

core::Result<ZigzagKind> zigzag_kind_from(std::string_view name) {
  for (std::size_t i = 0; i < kKindNames.size(); ++i) {
    if (kKindNames[i] == name) return static_cast<ZigzagKind>(i);
  }
  return core::Error{core::ErrorCode::kUsage,
                     fmt::format("'{}' is not a kind of zig-zag; choose one of {}", name,
                                 fmt::join(kKindNames, ", "))};
}

core::Result<Trajectory> make_zigzag(const ZigzagOptions& options) {
  if (options.divisions < 1 || options.divisions > 100) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("sparsity 1/{} is outside 1/1 to 1/100", options.divisions)};
  }
  RAVENCAL_RETURN_IF_ERROR(check_pace(options.pace));
  RAVENCAL_RETURN_IF_ERROR(check_range(options.limits));
  const bool three = options.limits.joints.size() == 3;
  const std::vector<VectorXd> corners =
      three ? corners_of_cube(options) : corners_of_sweeps(options);
  Trajectory trajectory;
  trajectory.joints = options.limits.joints;
  trajectory.joints_ji = round_corners(follow(corners, options.pace * options.limits.fastest_ji));
  for (VectorXd& joints : trajectory.joints_ji) {  // the last bit of rounding
    joints = joints.cwiseMax(options.limits.low_ji).cwiseMin(options.limits.high_ji).eval();
  }
  trajectory.t_s.resize(trajectory.joints_ji.size());
  for (std::size_t i = 0; i < trajectory.t_s.size(); ++i) {
    trajectory.t_s[i] = static_cast<double>(i) / kSampleRateHz;
  }
  return trajectory;
}

}  // namespace ravencal::trajectory
