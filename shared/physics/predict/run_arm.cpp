// SPDX-License-Identifier: Apache-2.0
#include "physics/predict/run_arm.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/drive_model.hpp"
#include "physics/drives.hpp"
#include "physics/plant_effort.hpp"
#include "physics/rigid_bodies.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What the links of a plant resist, at the joints.
class LinkDynamics {
 public:
  static core::Result<LinkDynamics> create(const Plant& plant) {
    LinkDynamics links(plant);
    if (!has_frames(plant)) return links;
    RAVENCAL_ASSIGN_OR_RETURN(links.bodies_, RigidBodies::create(plant));
    return links;
  }

  /// Weight and, of what moves, centrifugal and Coriolis efforts.
  VectorXd held(const VectorXd& q, const VectorXd& v) {
    return efforts(q, v, VectorXd::Zero(q.size()));
  }

  MatrixXd mass_matrix(const VectorXd& q) {
    if (bodies_) return bodies_->mass_matrix(q);
    const VectorXd none = VectorXd::Zero(q.size());
    const VectorXd weight = held(q, none);
    MatrixXd mass(q.size(), q.size());
    for (Index j = 0; j < q.size(); ++j)
      mass.col(j) = efforts(q, none, VectorXd::Unit(q.size(), j)) - weight;
    return mass;
  }

 private:
  explicit LinkDynamics(const Plant& plant) : plant_(&plant) {}

  VectorXd efforts(const VectorXd& q, const VectorXd& v, const VectorXd& a) {
    if (bodies_) return bodies_->efforts(q, v, a);
    std::vector<Motion> row;
    for (Index j = 0; j < q.size(); ++j)
      row.push_back({VectorXd::Constant(1, q[j]), VectorXd::Constant(1, v[j]),
                     VectorXd::Constant(1, a[j]), 0.0});
    VectorXd out(q.size());
    const std::vector<VectorXd> of_joints = link_efforts(*plant_, row);
    for (Index j = 0; j < q.size(); ++j) out[j] = of_joints[static_cast<std::size_t>(j)][0];
    return out;
  }

  const Plant* plant_;
  std::optional<RigidBodies> bodies_;
};

MatrixXd nominal_coupling(const Plant& plant) {
  const auto count = static_cast<Index>(plant.joints.size());
  MatrixXd coupling = MatrixXd::Identity(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index k = 0; k < i; ++k)
      coupling(i, k) = -plant.coupling[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
  return coupling;
}

}  // namespace

struct ArmRun::Impl {
  Impl(Plant of, std::vector<ArmServo> with)
      : plant(std::move(of)),
        servos(std::move(with)),
        steps(std::lround(plant.robot.inner_rate_hz / plant.robot.control_rate_hz)),
        dt_s(1.0 / plant.robot.inner_rate_hz),
        count(static_cast<Index>(plant.joints.size())),
        states(plant.joints.size()) {
    const DriveKinematics kinematics = drive_kinematics(plant);
    through =
        (MatrixXd::Identity(count, count) - kinematics.of_joint).inverse() * kinematics.of_motor;
    for (const Joint& joint : plant.joints) {
      const double motor = joint.motor_inertia_kg_m2 * joint.reduction * joint.reduction;
      numbers.push_back(drive_numbers(joint, motor, unstated_presliding(joint)));
      limits.push_back(joint.parameter("saturation", "limit"));
    }
  }

  /// What the links do to the motors where these are.
  void look_at_links() {
    VectorXd q(count), v(count);
    for (Index j = 0; j < count; ++j) {
      q[j] = state(j).position;
      v[j] = state(j).velocity;
    }
    mass = through.transpose() * links->mass_matrix(through * q) * through;
    for (Index j = 0; j < count; ++j) mass(j, j) += of(j).inertia;
    load = through.transpose() * links->held(through * q, through * v);
    weight = load;
    const bool any = std::any_of(servos.begin(), servos.end(),
                                 [](const ArmServo& servo) { return servo.holds_weight; });
    if (any) weight = through.transpose() * links->held(through * q, VectorXd::Zero(count));
  }

  /// The greatest effort that joint j is given; 0: any.
  [[nodiscard]] double limit_of(Index j) const {
    const double drive = limits[static_cast<std::size_t>(j)];
    const double servo = servos[static_cast<std::size_t>(j)].law.limit;
    return drive > 0.0 && servo > 0.0 ? std::min(drive, servo) : std::max(drive, servo);
  }

  /// Velocities at the end of a step and the efforts asked on the way. An effort beyond its limit
  /// stays at that, which changes what its neighbours do.
  void solve(const VectorXd& wanted, const VectorXd& wanted_velocity, VectorXd& ends) {
    std::vector<char> clipped(static_cast<std::size_t>(count), 0);
    VectorXd ahead(count), push(count), drag(count);
    for (Index j = 0; j < count; ++j) {
      const ArmServo& servo = servos[static_cast<std::size_t>(j)];
      ahead[j] = servo.law.effort_ahead(wanted[j] - state(j).position, state(j).velocity,
                                        wanted_velocity[j]);
      if (servo.holds_weight) ahead[j] += weight[j];
    }
    for (Index pass = 0; pass <= count; ++pass) {
      for (Index j = 0; j < count; ++j) {
        const auto place = static_cast<std::size_t>(j);
        const double effort = clipped[place] != 0 ? asked[j] : ahead[j];
        const auto [p, d] = push_of_drive(of(j), effort, load[j], dt_s, state(j));
        push[j] = p;
        drag[j] = d;
        if (clipped[place] == 0)
          drag[j] += (1.0 + of(j).torque_ratio) * servos[place].law.half_rate();
      }
      factors.compute(mass + MatrixXd((dt_s * drag).asDiagonal()));
      ends = factors.solve(mass * velocities() + dt_s * push);
      bool again = false;
      for (Index j = 0; j < count; ++j) {
        const auto place = static_cast<std::size_t>(j);
        if (clipped[place] != 0) continue;
        asked[j] = ahead[j] - servos[place].law.half_rate() * ends[j];
        const double limit = limit_of(j);
        if (!(limit > 0.0) || !(std::abs(asked[j]) > limit)) continue;
        asked[j] = std::copysign(limit, asked[j]);
        clipped[place] = 1;
        again = true;
      }
      if (!again) break;
    }
  }

  void advance(const VectorXd& from, const VectorXd& to) {
    look_at_links();
    const VectorXd wanted_velocity = (to - from) / (static_cast<double>(steps) * dt_s);
    VectorXd ends(count);
    for (long k = 0; k < steps; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(steps);
      solve(from + share * (to - from), wanted_velocity, ends);
      if (k == 0) {
        seen = 0.5 * (velocities() + ends);
        efforts = asked;
      }
      for (Index j = 0; j < count; ++j) {
        state(j).velocity = ends[j];
        move_drive(of(j), dt_s, state(j));
        motors[j] = state(j).position;
      }
    }
  }

  [[nodiscard]] const DriveNumbers<double>& of(Index j) const {
    return numbers[static_cast<std::size_t>(j)];
  }
  [[nodiscard]] DriveState<double>& state(Index j) { return states[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const DriveState<double>& state(Index j) const {
    return states[static_cast<std::size_t>(j)];
  }
  [[nodiscard]] VectorXd velocities() const {
    VectorXd v(count);
    for (Index j = 0; j < count; ++j) v[j] = state(j).velocity;
    return v;
  }

  Plant plant;
  std::vector<ArmServo> servos;
  long steps;
  double dt_s;
  Index count;
  std::vector<DriveState<double>> states;
  MatrixXd through;  ///< joints per motor positions
  std::optional<LinkDynamics> links;
  std::vector<DriveNumbers<double>> numbers;  ///< `inertia`: of the motor alone
  std::vector<double> limits;
  Eigen::LLT<MatrixXd> factors;
  MatrixXd mass;
  VectorXd load, weight, asked = VectorXd::Zero(count);
  VectorXd motors = VectorXd::Zero(count), seen = VectorXd::Zero(count);
  VectorXd efforts = VectorXd::Zero(count);
};

core::Result<ArmRun> ArmRun::create(const Plant& plant, std::vector<ArmServo> servos) {
  auto impl = std::make_unique<Impl>(plant, std::move(servos));
  RAVENCAL_ASSIGN_OR_RETURN(impl->links, LinkDynamics::create(impl->plant));
  impl->look_at_links();
  return ArmRun(std::move(impl));
}

ArmRun::ArmRun(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ArmRun::ArmRun(ArmRun&&) noexcept = default;
ArmRun& ArmRun::operator=(ArmRun&&) noexcept = default;
ArmRun::~ArmRun() = default;

void ArmRun::place(const VectorXd& motors_ji) {
  impl_->motors = motors_ji;
  for (Index j = 0; j < impl_->count; ++j) impl_->state(j) = {motors_ji[j], 0.0, 0.0};
  impl_->look_at_links();
}

void ArmRun::advance(const VectorXd& from, const VectorXd& to) { impl_->advance(from, to); }
const VectorXd& ArmRun::motors_ji() const { return impl_->motors; }
const VectorXd& ArmRun::velocities_ji() const { return impl_->seen; }
const VectorXd& ArmRun::efforts() const { return impl_->efforts; }
const MatrixXd& ArmRun::inertia() const { return impl_->mass; }

VectorXd asked_motors(const Plant& plant, const VectorXd& joints_ji) {
  return nominal_coupling(plant) * joints_ji;
}

VectorXd believed_joints(const Plant& plant, const VectorXd& motors_ji) {
  return nominal_coupling(plant).triangularView<Eigen::UnitLower>().solve(motors_ji);
}

}  // namespace ravencal::physics
