// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "trajectory/trajectory.hpp"

namespace ravencal::trajectory {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using physics::JointKind;

/// By which a trajectory may pass a limit: its file has nine digits of positions and three of the
/// time, of which a speed over a hundredth of a second keeps three.
constexpr double kRoundedPosition = 1e-8, kRoundedSpeed = 1e-3;
constexpr std::size_t kHeaderLines = 1;  ///< of a trajectory's file

std::string_view unit_of(JointKind kind) { return kind == JointKind::kRevolute ? "rad" : "m"; }

std::string names_of(const std::vector<MovedJoint>& joints) {
  std::vector<std::string_view> names;
  for (const MovedJoint& joint : joints) names.emplace_back(joint.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// What the plant leaves out of a joint's limits, as its keys are called; empty: nothing.
std::string missing_limits(const physics::Joint& joint) {
  const std::string unit(unit_of(joint.kind));
  std::vector<std::string> missing;
  if (!joint.limits.low_ji) missing.push_back("low_" + unit);
  if (!joint.limits.high_ji) missing.push_back("high_" + unit);
  if (!joint.limits.speed_ji) missing.push_back(fmt::format("speed_{}_per_s", unit));
  return fmt::format("{}", fmt::join(missing, ", "));
}

}  // namespace

std::vector<MovedJoint> raven_joints() {
  return {{"shoulder", JointKind::kRevolute},
          {"elbow", JointKind::kRevolute},
          {"insertion", JointKind::kPrismatic}};
}

std::vector<MovedJoint> joints_of(const physics::Plant& plant) {
  std::vector<MovedJoint> joints;
  for (const physics::Joint& joint : plant.joints) joints.push_back({joint.name, joint.kind});
  return joints;
}

core::Result<JointLimits> limits_of(const physics::Plant& plant) {
  const auto count = static_cast<Index>(plant.joints.size());
  JointLimits limits{joints_of(plant), VectorXd(count), VectorXd(count), VectorXd(count)};
  for (Index j = 0; j < count; ++j) {
    const physics::Joint& joint = plant.joints[static_cast<std::size_t>(j)];
    if (const std::string missing = missing_limits(joint); !missing.empty())
      return core::data_error(
          fmt::format("{}: joint '{}' states no {} in [joint.limits]: a trajectory has to know "
                      "between which positions it may move, and how fast",
                      plant.source, joint.name, missing));
    limits.low_ji[j] = *joint.limits.low_ji;
    limits.high_ji[j] = *joint.limits.high_ji;
    limits.fastest_ji[j] = *joint.limits.speed_ji;
  }
  return limits;
}

core::Result<Trajectory> in_order(Trajectory trajectory, const std::vector<MovedJoint>& joints,
                                  const std::string& source, const std::string& whose) {
  if (trajectory.joints == joints) return trajectory;
  const auto refuse = [&](const std::string& what) {
    return core::data_error(fmt::format(
        "{}: {}; the trajectory moves {}, and {} has {}; `ravencal trajectory zigzag --plant` "
        "makes one of a plant's joints",
        source, what, names_of(trajectory.joints), whose, names_of(joints)));
  };
  std::vector<Index> columns;
  for (const MovedJoint& joint : joints) {
    const auto own =
        std::find_if(trajectory.joints.begin(), trajectory.joints.end(),
                     [&](const MovedJoint& other) { return other.name == joint.name; });
    if (own == trajectory.joints.end()) return refuse(fmt::format("no column of '{}'", joint.name));
    if (own->kind != joint.kind)
      return refuse(fmt::format("'{}' is in {} and must be in {}", joint.name, unit_of(own->kind),
                                unit_of(joint.kind)));
    columns.push_back(own - trajectory.joints.begin());
  }
  if (trajectory.joints.size() != joints.size()) return refuse("joints too many");
  for (VectorXd& row : trajectory.joints_ji) row = VectorXd(row(columns));
  trajectory.joints = joints;
  return trajectory;
}

core::Status check_limits(const Trajectory& trajectory, const physics::Plant& plant,
                          const std::string& source) {
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    const std::string_view unit = unit_of(joint.kind);
    const auto place = static_cast<Index>(j);
    const auto refuse = [&](std::size_t row, double value, std::string_view what, double limit,
                            std::string_view per) {
      return core::data_error(
          fmt::format("{}:{}: joint '{}' at {:.6g} {}{} is {} {:.6g} {}{}, its limit in {}", source,
                      row + 1 + kHeaderLines, joint.name, value, unit, per, what, limit, unit, per,
                      plant.source));
    };
    for (std::size_t row = 0; row < trajectory.t_s.size(); ++row) {
      const double at = trajectory.joints_ji[row][place];
      const auto& [low, high, speed] = joint.limits;
      if (low && at < *low - kRoundedPosition * std::max(1.0, std::abs(*low)))
        return refuse(row, at, "below", *low, "");
      if (high && at > *high + kRoundedPosition * std::max(1.0, std::abs(*high)))
        return refuse(row, at, "above", *high, "");
      if (row == 0 || !speed) continue;
      const double moved = std::abs(at - trajectory.joints_ji[row - 1][place]);
      const double velocity = moved / (trajectory.t_s[row] - trajectory.t_s[row - 1]);
      if (velocity > *speed * (1.0 + kRoundedSpeed))
        return refuse(row, velocity, "above", *speed, "/s");
    }
  }
  return {};
}

core::Result<Trajectory> read_for_plant(const std::filesystem::path& path,
                                        const physics::Plant& plant) {
  RAVENCAL_ASSIGN_OR_RETURN(Trajectory trajectory, read_csv(path));
  RAVENCAL_ASSIGN_OR_RETURN(
      trajectory, in_order(std::move(trajectory), joints_of(plant), path.string(), plant.source));
  RAVENCAL_RETURN_IF_ERROR(check_limits(trajectory, plant, path.string()));
  return trajectory;
}

}  // namespace ravencal::trajectory
