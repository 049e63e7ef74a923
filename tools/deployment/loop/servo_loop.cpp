// SPDX-License-Identifier: Apache-2.0
#include "loop/servo_loop.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/joint_layout.hpp"
#include "physics/arm_dynamics.hpp"
#include "physics/drives.hpp"
#include "physics/raven_controller.hpp"
#include "physics/raven_kinematics.hpp"

namespace ravencal::loop {
namespace {

using core::RavenField;
using Eigen::Index;
using Eigen::Matrix3cd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Index kStates = 12;  // motors, joints, and their velocities
using StateMatrix = Eigen::Matrix<double, kStates, kStates>;
using PoseMatrix = Eigen::Matrix<double, 12, 3>;
constexpr double kPoseStep_ji = 1e-3;  // 0.06 deg or 1 mm; the pose is known to whole micrometres
constexpr double kMetresPerMicrometre = 1e-6;

core::Status check(const physics::Plant& plant) {
  const auto fail = [&](const std::string& why) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: {}", plant.source, why)};
  };
  if (plant.joints.size() != 3) {
    return fail(fmt::format("the servo loop needs 3 joints, found {}", plant.joints.size()));
  }
  for (const physics::Joint& joint : plant.joints) {
    if (!joint.controller) {
      return fail(fmt::format("joint '{}' needs a [joint.controller]", joint.name));
    }
    if (!(joint.parameter("compliance", "stiffness") > 0.0)) {
      return fail(fmt::format("joint '{}' needs effect 'compliance': the cable", joint.name));
    }
    if (!(joint.link.mass_kg > 0.0) || !(joint.motor_inertia_kg_m2 > 0.0)) {
      return fail(fmt::format("joint '{}' needs a mass and a motor inertia", joint.name));
    }
  }
  return {};
}

/// Columns: a linear map of 3 numbers applied to the unit vectors.
template <typename Map>
Matrix3d matrix_of(const Map& map) {
  Matrix3d matrix;
  for (Index i = 0; i < 3; ++i) matrix.col(i) = map(Vector3d::Unit(i));
  return matrix;
}

}  // namespace

struct ServoLoop::Impl {
  Impl(const physics::Plant& plant_in, const ServoOptions& options_in)
      : plant(plant_in),
        options(options_in),
        arm(plant.robot.arm == "green" ? physics::Arm::kGreen : physics::Arm::kGold),
        dynamics(plant, arm, true),
        cycle_s(1.0 / plant.robot.control_rate_hz),
        of_motor(physics::drive_kinematics(plant).of_motor),
        stretch_of_joint(Matrix3d::Identity() - physics::drive_kinematics(plant).of_joint) {
    for (Index i = 0; i < 3; ++i) {
      const physics::Joint& joint = plant.joints[static_cast<std::size_t>(i)];
      reduction[i] = joint.reduction;
      const physics::DriveLosses losses = physics::drive_losses(joint);
      inertia[i] = losses.inertia;
      effort_per_torque[i] = joint.reduction / joint.gearbox_ratio * losses.effort_ratio;
      viscous[i] = losses.viscous;
      stiffness[i] = joint.parameter("compliance", "stiffness");
      damping[i] = joint.parameter("compliance", "damping");
      kp[i] = joint.controller->kp_n_m_per_rad;
      kd[i] = joint.controller->kd_n_m_s_per_rad;
      dac_per_torque[i] = joint.drive.dac_counts_per_n_m;
      counts_per_rad[i] = joint.encoder_sign * plant.sensors.motor_encoder_counts_per_rev /
                          (2.0 * std::numbers::pi);
    }
    motors_from_joints =
        matrix_of([&](const Vector3d& v) { return physics::motors_from_joints(plant, v); });
    joints_from_motors =
        matrix_of([&](const Vector3d& v) { return physics::joints_from_motors(plant, v); });
  }

  /// Continuous state (q, y, q', y') of motors and joints, and its zero-order hold equivalent. A
  /// cable is stretched by of_motor q - stretch_of_joint y, and by virtual work its tension acts on
  /// both through the transposes.
  void linearise(const Vector3d& joints_ji) {
    const Matrix3d k = stiffness.asDiagonal();
    const Matrix3d b = damping.asDiagonal();
    const Matrix3d inverse_inertia = inertia.cwiseInverse().asDiagonal();
    const Matrix3d inverse_mass = dynamics.mass_matrix(joints_ji).inverse();
    const Matrix3d drag = viscous.asDiagonal();
    const Matrix3d on_motor = inverse_inertia * of_motor.transpose();
    const Matrix3d on_joint = inverse_mass * stretch_of_joint.transpose();
    Eigen::Matrix<double, kStates + 3, kStates + 3> system;
    system.setZero();
    system.block<3, 3>(0, 6).setIdentity();
    system.block<3, 3>(3, 9).setIdentity();
    system.block<3, 3>(6, 0) = -on_motor * k * of_motor;
    system.block<3, 3>(6, 3) = on_motor * k * stretch_of_joint;
    system.block<3, 3>(6, 6) = -inverse_inertia * drag - on_motor * b * of_motor;
    system.block<3, 3>(6, 9) = on_motor * b * stretch_of_joint;
    system.block<3, 3>(9, 0) = on_joint * k * of_motor;
    system.block<3, 3>(9, 3) = -on_joint * k * stretch_of_joint;
    system.block<3, 3>(9, 6) = on_joint * b * of_motor;
    system.block<3, 3>(9, 9) = -on_joint * b * stretch_of_joint;
    system.block<3, 3>(6, 12) = inverse_inertia * Matrix3d(effort_per_torque.asDiagonal());
    const Eigen::MatrixXd held = Eigen::MatrixXd(system * cycle_s).exp();
    transition = held.topLeftCorner(kStates, kStates);
    input = held.topRightCorner(kStates, 3);
    set_pose(joints_ji);
  }

  /// d pose / d joints by central differences of the controller's kinematics.
  void set_pose(const Vector3d& joints_ji) {
    physics::SlotVector slots{};
    for (std::size_t i = 0; i < 4; ++i) slots[4 + i] = plant.robot.tool_joints_rad[i];
    const auto pose_at = [&](const Vector3d& joints) {
      for (std::size_t i = 0; i < 3; ++i) slots[i] = joints[static_cast<Index>(i)];
      const physics::ToolPose tool = physics::forward_kinematics(arm, slots);
      Eigen::Matrix<double, 12, 1> values;
      for (std::size_t i = 0; i < 3; ++i)
        values[static_cast<Index>(i)] = kMetresPerMicrometre * tool.position_um[i];
      for (std::size_t i = 0; i < 9; ++i) values[static_cast<Index>(3 + i)] = tool.rotation[i];
      return values;
    };
    for (Index i = 0; i < 3; ++i) {
      const Vector3d step = kPoseStep_ji * Vector3d::Unit(i);
      pose.col(i) = (pose_at(joints_ji + step) - pose_at(joints_ji - step)) / (2.0 * kPoseStep_ji);
    }
  }

  void respond(Complex z, bool is_dc) {
    cycle_ago = 1.0 / z;
    const Matrix3cd c = motors_from_joints.cast<Complex>();
    mpos_d = -c;
    if (is_dc) {  // the motors have followed, at rest
      tau.setZero();
      mpos = -c;
      mvel.setZero();
      return;
    }
    const Eigen::Matrix<Complex, kStates, kStates> resolvent =
        z * StateMatrix::Identity().cast<Complex>() - transition.cast<Complex>();
    const Matrix3cd motors = reduction.cast<Complex>().asDiagonal() *
                             resolvent.partialPivLu().solve(input.cast<Complex>()).topRows<3>();
    const Complex age = std::pow(cycle_ago, options.encoder_age_cycles);
    const Complex rate = (1.0 - cycle_ago) / cycle_s;
    const Vector3d none = Vector3d::Zero();
    const Eigen::Vector3cd servo = kp.cast<Complex>() + rate * kd.cast<Complex>() + none;
    const Matrix3cd closed = Matrix3cd::Identity() + servo.asDiagonal() * (age * motors);
    const Matrix3cd wanted = kp.cast<Complex>().asDiagonal() * c;
    tau = -closed.partialPivLu().solve(wanted);
    mpos = age * motors * tau;
    mvel = rate * mpos;
  }

  physics::Plant plant;
  ServoOptions options;
  physics::Arm arm;
  physics::ArmDynamics dynamics;
  double cycle_s;
  Matrix3d of_motor;          ///< of DriveKinematics
  Matrix3d stretch_of_joint;  ///< how far a joint relaxes its own and other cables
  Matrix3d motors_from_joints;
  Matrix3d joints_from_motors;
  Vector3d reduction, inertia, effort_per_torque, viscous, stiffness, damping, kp, kd;
  Vector3d dac_per_torque, counts_per_rad;
  // of the posture
  StateMatrix transition;
  Eigen::Matrix<double, kStates, 3> input;
  PoseMatrix pose;
  // of the frequency: responses in the cycle in which they are computed
  Complex cycle_ago;
  Matrix3cd tau, mpos, mvel, mpos_d;
};

core::Result<ServoLoop> ServoLoop::create(const physics::Plant& plant,
                                          const ServoOptions& options) {
  RAVENCAL_RETURN_IF_ERROR(check(plant));
  return ServoLoop(std::make_unique<Impl>(plant, options));
}

ServoLoop::ServoLoop(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ServoLoop::ServoLoop(ServoLoop&&) noexcept = default;
ServoLoop& ServoLoop::operator=(ServoLoop&&) noexcept = default;
ServoLoop::~ServoLoop() = default;

void ServoLoop::set_posture(const Vector3d& joints_ji) { impl_->linearise(joints_ji); }
double ServoLoop::cycle_s() const { return impl_->cycle_s; }
void ServoLoop::set_frequency(Complex z, bool is_dc) { impl_->respond(z, is_dc); }

Response ServoLoop::of(RavenField field, std::size_t element) const {
  const Impl& loop = *impl_;
  const auto i = static_cast<Index>(element);
  const bool is_pose = field == RavenField::kPos || field == RavenField::kOri ||
                       field == RavenField::kPosD || field == RavenField::kOriD;
  if (!is_pose && i >= 3) return Response::Zero();
  const Index row = field == RavenField::kOri || field == RavenField::kOriD ? 3 + i : i;
  const auto joints = loop.joints_from_motors.cast<Complex>();
  switch (field) {
    case RavenField::kMpos:
      return loop.mpos.row(i);
    case RavenField::kEncVals:
      return loop.counts_per_rad[i] * loop.mpos.row(i);
    case RavenField::kMvel:
      return loop.mvel.row(i);
    case RavenField::kJpos:
      return joints.row(i) * loop.mpos;
    case RavenField::kJvel:
      if (loop.options.coupled_joint_velocity) return joints.row(i) * loop.mvel;
      return loop.mvel.row(i) / loop.reduction[i];
    // What the controller computes after the hook is a cycle old there.
    case RavenField::kTau:
      return loop.cycle_ago * loop.tau.row(i);
    case RavenField::kDac:
      return loop.cycle_ago * loop.dac_per_torque[i] * loop.tau.row(i);
    case RavenField::kMposD:
      return loop.cycle_ago * loop.mpos_d.row(i);
    case RavenField::kJposD:
      return loop.cycle_ago * (joints.row(i) * loop.mpos_d);
    case RavenField::kPos:
    case RavenField::kOri:
      return loop.cycle_ago * (loop.pose.row(row).cast<Complex>() * joints * loop.mpos);
    case RavenField::kPosD:
    case RavenField::kOriD:
      return loop.cycle_ago * (loop.pose.row(row).cast<Complex>() * joints * loop.mpos_d);
    default:
      return Response::Zero();
  }
}

Answer answer_of(std::string_view channel) {
  const auto index = core::catalogue_index_of(channel);
  if (!index || core::catalogue()[*index].other_arm) return Answer::kNone;
  const core::CatalogueEntry& entry = core::catalogue()[*index];
  switch (entry.field) {
    case RavenField::kJacVel:
    case RavenField::kJacF:
      return Answer::kUnknown;
    case RavenField::kTime:
    case RavenField::kRunlevel:
    case RavenField::kSublevel:
    case RavenField::kLastSeq:
    case RavenField::kType:
    case RavenField::kGraspD:
    case RavenField::kEncOffsets:
      return Answer::kNone;
    default:
      break;
  }
  const bool is_tool =
      entry.joint_slot != core::kNoJoint && entry.joint_slot >= core::kCalibratedJointCount;
  return is_tool ? Answer::kNone : Answer::kModelled;
}

}  // namespace ravencal::loop
