// SPDX-License-Identifier: Apache-2.0
#include "learn/motor_coordinates.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <string>

namespace ravencal::learn {
namespace {

constexpr Eigen::Index kJoints = 3;
constexpr std::array<const char*, kJoints> kNames = {"shoulder", "elbow", "insertion"};
/// The insertion in rad: 0.05 m are as much motion as half a radian.
constexpr double kInsertionPerRad = 0.1;
/// Single precision, and degrees with six digits, round jpos by 2e-7 rad
/// (../shared/data/raven2_uiuc). A correction that matters is a hundredth of a degree or more.
constexpr double kRounding_rad = 2e-5;
/// Motors that moved less in proportion to where they stand do not tell a constant from a coupling.
constexpr double kLeastMotion = 1e-3;
constexpr Eigen::Index kLeastRows = 50;

using Rows = Eigen::Matrix<double, Eigen::Dynamic, kJoints>;

/// The rows in which all channels are numbers; empty where a channel is missing.
bool take(const record::Recording& recording, Rows& joints_rad, Rows& motors_rad) {
  std::array<Eigen::Index, 2 * kJoints> columns{};
  for (std::size_t j = 0; j < kNames.size(); ++j) {
    const auto joint = recording.column(std::string("jpos.") + kNames[j]);
    const auto motor = recording.column(std::string("mpos.") + kNames[j]);
    if (!joint || !motor) return false;
    columns[j] = *joint;
    columns[kNames.size() + j] = *motor;
  }
  joints_rad.resize(recording.rows(), kJoints);
  motors_rad.resize(recording.rows(), kJoints);
  Eigen::Index rows = 0;
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    for (Eigen::Index j = 0; j < kJoints; ++j) {
      const double per_rad = j == kJoints - 1 ? kInsertionPerRad : 1.0;
      joints_rad(rows, j) = recording.samples(row, columns[static_cast<std::size_t>(j)]) / per_rad;
      motors_rad(rows, j) = recording.samples(row, columns[static_cast<std::size_t>(kJoints + j)]);
    }
    if (joints_rad.row(rows).allFinite() && motors_rad.row(rows).allFinite()) ++rows;
  }
  joints_rad.conservativeResize(rows, kJoints);
  motors_rad.conservativeResize(rows, kJoints);
  return true;
}

/// A constant and the motors must be four directions, or one could stand for another.
bool moves_enough(const Rows& motors_rad) {
  if (motors_rad.rows() < kLeastRows) return false;
  Eigen::MatrixXd with_constant(motors_rad.rows(), kJoints + 1);
  with_constant.col(kJoints).setOnes();
  for (Eigen::Index j = 0; j < kJoints; ++j) {
    const double size = motors_rad.col(j).cwiseAbs().maxCoeff();
    if (size == 0.0) return false;
    with_constant.col(j) = motors_rad.col(j) / size;
  }
  const Eigen::VectorXd sizes =
      (with_constant.transpose() * with_constant).selfadjointView<Eigen::Lower>().eigenvalues();
  return sizes[0] > kLeastMotion * kLeastMotion * sizes[kJoints];
}

}  // namespace

MotorCoordinates motor_coordinates(const record::Recording& recording) {
  Rows joints_rad;
  Rows motors_rad;
  MotorCoordinates result;
  if (!take(recording, joints_rad, motors_rad) || !moves_enough(motors_rad)) return result;
  const Eigen::Matrix3d coupling = motors_rad.colPivHouseholderQr().solve(joints_rad);
  const Rows left_rad = joints_rad - motors_rad * coupling;
  result.unexplained_rad = left_rad.cwiseAbs().maxCoeff();
  const bool is_explained = left_rad.colwise().norm().maxCoeff() <=
                            kRounding_rad * std::sqrt(static_cast<double>(left_rad.rows()));
  result.coordinates = is_explained ? model::Coordinates::kMotor : model::Coordinates::kCorrected;
  return result;
}

}  // namespace ravencal::learn
