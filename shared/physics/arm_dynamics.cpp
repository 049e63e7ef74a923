// SPDX-License-Identifier: Apache-2.0
#include "physics/arm_dynamics.hpp"

#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>

namespace ravencal::physics {
namespace {

KDL::Vector vector_of(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

KDL::RigidBodyInertia inertia_of(double mass_kg, const std::array<double, 3>& com_m,
                                 const std::array<double, 3>& moments) {
  return KDL::RigidBodyInertia(mass_kg, vector_of(com_m),
                               KDL::RotationalInertia(moments[0], moments[1], moments[2]));
}

/// One fixed segment carries the twist and length before each joint, so that the moving segment's
/// tip frame is the link's own Denavit-Hartenberg frame, in which its centre of mass is given.
KDL::Chain make_chain(const Plant& plant, Arm arm, bool with_payload) {
  const DhTable& dh = dh_table(arm);
  KDL::Chain chain;
  for (std::size_t i = 0; i < 3; ++i) {
    const Joint& joint = plant.joints[i];
    chain.addSegment(
        KDL::Segment(KDL::Joint(KDL::Joint::None),
                     KDL::Frame::DH_Craig1989(dh.a_m[i], dh.alpha_rad[i], dh.d_m[i], 0.0)));
    KDL::RigidBodyInertia inertia =
        inertia_of(joint.link.mass_kg, joint.link.com_m, joint.link.inertia_kg_m2);
    if (i == 2 && with_payload && plant.payload.mass_kg > 0.0) {
      inertia = inertia + inertia_of(plant.payload.mass_kg, plant.payload.com_m, {});
    }
    const auto type = joint.kind == JointKind::kPrismatic ? KDL::Joint::TransZ : KDL::Joint::RotZ;
    chain.addSegment(KDL::Segment(
        KDL::Joint(type), KDL::Frame(KDL::Rotation::RotZ(dh.theta_offset_rad[i])), inertia));
  }
  return chain;
}

}  // namespace

struct ArmDynamics::Impl {
  Impl(const Plant& plant, Arm arm, bool with_payload)
      : chain(make_chain(plant, arm, with_payload)),
        solver(chain, vector_of(plant.robot.gravity_m_per_s2)),
        position(3),
        velocity(3),
        effort(3),
        inertia(3) {}

  KDL::Chain chain;
  KDL::ChainDynParam solver;  // keeps a reference to `chain`
  KDL::JntArray position;
  KDL::JntArray velocity;
  KDL::JntArray effort;
  KDL::JntSpaceInertiaMatrix inertia;
};

ArmDynamics::ArmDynamics(const Plant& plant, Arm arm, bool with_payload)
    : impl_(std::make_unique<Impl>(plant, arm, with_payload)) {}
ArmDynamics::ArmDynamics(ArmDynamics&&) noexcept = default;
ArmDynamics& ArmDynamics::operator=(ArmDynamics&&) noexcept = default;
ArmDynamics::~ArmDynamics() = default;

Eigen::Matrix3d ArmDynamics::mass_matrix(const Eigen::Vector3d& joints_ji) {
  impl_->position.data = joints_ji;
  impl_->solver.JntToMass(impl_->position, impl_->inertia);
  return impl_->inertia.data;
}

Eigen::Vector3d ArmDynamics::gravity(const Eigen::Vector3d& joints_ji) {
  impl_->position.data = joints_ji;
  impl_->solver.JntToGravity(impl_->position, impl_->effort);
  return impl_->effort.data;
}

Eigen::Vector3d ArmDynamics::coriolis(const Eigen::Vector3d& joints_ji,
                                      const Eigen::Vector3d& velocities_ji) {
  impl_->position.data = joints_ji;
  impl_->velocity.data = velocities_ji;
  impl_->solver.JntToCoriolis(impl_->position, impl_->velocity, impl_->effort);
  return impl_->effort.data;
}

}  // namespace ravencal::physics
