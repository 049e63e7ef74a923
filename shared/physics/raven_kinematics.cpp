// SPDX-License-Identifier: Apache-2.0
#include "physics/raven_kinematics.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/raven_arm.hpp"

namespace ravencal::physics {
namespace {

using core::JointSlot;

constexpr double kPi = std::numbers::pi;
constexpr double kToolLength = 0.013;   // Lw: RAVEN tool, wrist to jaws, m
constexpr double kShaftLength = -0.47;  // d4, m

constexpr DhTable with_tool(const core::ArmGeometry& arm) {
  return {{arm.twist_rad[0], arm.twist_rad[1], arm.twist_rad[2], 0.0, kPi / 2, kPi / 2},
          {0.0, 0.0, 0.0, 0.0, 0.0, kToolLength},
          {0.0, 0.0, 0.0, kShaftLength, 0.0, 0.0},
          {arm.joint_offset_rad[0], arm.joint_offset_rad[1], arm.joint_offset_rad[2], 0.0, -kPi / 2,
           0.0}};
}
constexpr DhTable kGold = with_tool(core::kGoldGeometry);
constexpr DhTable kGreen = with_tool(core::kGreenGeometry);

// GP32 gearbox and tool pulleys; GB_RATIO of defines.h couples the tool to the insertion motor.
constexpr double kToolCoupling = 2.908700441;
constexpr double kRollReduction = 5.395176252;
constexpr double kWristReduction = 8.991960421;

constexpr std::size_t slot(JointSlot s) { return static_cast<std::size_t>(s); }

Eigen::Isometry3d dh_transform(double alpha, double a, double theta, double d) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.rotate(Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitX()));
  transform.translate(Eigen::Vector3d(a, 0.0, 0.0));
  transform.rotate(Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitZ()));
  transform.translate(Eigen::Vector3d(0.0, 0.0, d));
  return transform;
}

double tool_sign(Arm arm, JointSlot s) {
  const double sign = arm == Arm::kGold ? 1.0 : -1.0;
  return s == JointSlot::kGrasp1 ? -sign : sign;
}

constexpr std::array<JointSlot, 4> kToolSlots = {JointSlot::kRoll, JointSlot::kWrist,
                                                 JointSlot::kGrasp1, JointSlot::kGrasp2};

}  // namespace

const DhTable& dh_table(Arm arm) { return arm == Arm::kGold ? kGold : kGreen; }

ToolPose forward_kinematics(Arm arm, const SlotVector& joints_ji) {
  const DhTable& dh = dh_table(arm);
  const double jaws =
      0.5 * (joints_ji[slot(JointSlot::kGrasp2)] - joints_ji[slot(JointSlot::kGrasp1)]);
  const std::array<double, 6> joint_angle = {joints_ji[0],
                                             joints_ji[1],
                                             0.0,
                                             joints_ji[slot(JointSlot::kRoll)],
                                             joints_ji[slot(JointSlot::kWrist)],
                                             jaws};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < 6; ++i) {
    const double d = dh.d_m[i] + (i == 2 ? joints_ji[slot(JointSlot::kInsertion)] : 0.0);
    pose =
        pose * dh_transform(dh.alpha_rad[i], dh.a_m[i], joint_angle[i] + dh.theta_offset_rad[i], d);
  }
  ToolPose result;
  for (Eigen::Index i = 0; i < 3; ++i) {
    result.position_um[static_cast<std::size_t>(i)] =
        static_cast<std::int32_t>(pose.translation()[i] * 1e6);
    for (Eigen::Index k = 0; k < 3; ++k) {
      result.rotation[static_cast<std::size_t>(3 * i + k)] = pose.linear()(i, k);
    }
  }
  return result;
}

double tool_reduction(JointSlot s) {
  return s == JointSlot::kRoll ? kRollReduction : kWristReduction;
}

void tool_motors_from_joints(Arm arm, const SlotVector& joints_ji, SlotVector& motors_rad) {
  const double insertion_share = motors_rad[slot(JointSlot::kInsertion)] / kToolCoupling;
  for (const JointSlot s : kToolSlots) {
    motors_rad[slot(s)] =
        joints_ji[slot(s)] * tool_reduction(s) + tool_sign(arm, s) * insertion_share;
  }
}

void tool_joints_from_motors(Arm arm, const SlotVector& motors_rad, SlotVector& joints_ji) {
  const double insertion_share = motors_rad[slot(JointSlot::kInsertion)] / kToolCoupling;
  for (const JointSlot s : kToolSlots) {
    joints_ji[slot(s)] =
        (motors_rad[slot(s)] - tool_sign(arm, s) * insertion_share) / tool_reduction(s);
  }
}

std::array<double, 6> placeholder_jacobian_velocity(const SlotVector& joints_ji,
                                                    const SlotVector& velocities_ji) {
  constexpr std::array<double, 6> kAlpha = {0.0, 1.0, kPi - 1.0, 0.0, kPi / 2, kPi / 2};
  constexpr std::array<double, 6> kA = {0.0, 0.0, 0.0, 6.0, 0.0, 0.0};
  constexpr std::array<std::size_t, 6> kSlots = {0, 1, 2, 4, 5, 6};
  std::array<Eigen::Isometry3d, 6> frames;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < 6; ++i) {
    const double theta =
        i == 2 ? kGold.theta_offset_rad[2] : joints_ji[kSlots[i]] + kGold.theta_offset_rad[i];
    pose = pose * dh_transform(kAlpha[i], kA[i], theta, 0.0);
    frames[i] = pose;
  }
  Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d axis = frames[i].linear().col(2);
    const double rate = velocities_ji[kSlots[i]];
    if (i == 2) {
      twist.head<3>() += rate * axis;
    } else {
      twist.head<3>() += rate * axis.cross(pose.translation() - frames[i].translation());
      twist.tail<3>() += rate * axis;
    }
  }
  std::array<double, 6> result{};
  for (std::size_t i = 0; i < 6; ++i) result[i] = twist[static_cast<Eigen::Index>(i)];
  return result;
}

}  // namespace ravencal::physics
