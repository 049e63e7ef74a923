// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/nominal.hpp"

#include <cmath>
#include <numbers>

namespace ravencal::prove {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDeg = kPi / 180.0;
constexpr double kGearbox = 12.25;          // GP42
constexpr double kDacPerTorque = -3695.81;  // counts per N m at the capstan, gold arm
/// Stiffness of a cable that counts as rigid: it stretches less than the truth's noise.
constexpr double kRigid = 60000.0, kRigidPrismatic = 8e5;
/// Bristles of a joint whose plant has no presliding.
constexpr double kShortBristle = 1e-4, kShortBristlePrismatic = 1e-5;

NominalJoint rotary(const char* name, double reduction, double mass, const Vector3d& com,
                    const Vector3d& inertia) {
  NominalJoint j;
  j.name = name;
  j.motor_inertia_kg_m2 = 2.32e-5;
  j.gearbox_ratio = kGearbox;
  j.reduction = reduction;
  j.mass_kg = mass;
  j.com_m = com;
  j.inertia_kg_m2 = inertia;
  j.kp = 0.3;
  j.kd = 0.008;
  j.dac_limit_counts = 2500;
  j.dac_counts_per_n_m = kDacPerTorque;
  j.truth_resolution = 2.0 * kPi / 80000.0;
  return j;
}

void draw_cable_and_friction(NominalJoint& j, Random& random) {
  const bool p = j.prismatic;
  j.stiffness = p ? random.log_uniform(18000, 40000) : random.log_uniform(150, 450);
  j.cable_damping = j.stiffness * 0.004;
  j.joint_friction = p ? random.uniform(1.0, 2.0) : random.uniform(0.35, 0.6);
  j.joint_presliding = p ? 2e-5 : 5e-4;
  j.coulomb = p ? random.uniform(11.0, 16.0) : random.uniform(1.2, 1.9);
  j.viscous = p ? random.uniform(600, 900) : random.uniform(2.0, 3.0);
  j.presliding = p ? random.uniform(1.5e-5, 4e-5) : random.uniform(2e-4, 5e-4);
  j.stribeck_velocity = p ? 0.0008 : 0.01;
  j.stribeck_extra = random.uniform() < 0.5 ? 0.0 : 0.2 * j.coulomb;
}

}  // namespace

NominalRobot draw_raven(Random& random) {
  NominalRobot robot;
  robot.name = "raven2";
  robot.gravity = {-9.8, 0.0, 0.0};
  robot.joints = {
      rotary("shoulder", 136.196255507, 0.494, {0.0065, 0.09775, -0.13771},
             {0.017376, 0.011, 0.006499}),
      rotary("elbow", 121.522074965, 0.750, {-0.002, -0.18274, -0.23053},
             {0.081579, 0.044329, 0.037686}),
      rotary("insertion", 2158.590308370, 0.231, Vector3d::Zero(), {0.002908, 0.003009, 0.000355})};
  NominalJoint& insertion = robot.joints[2];
  insertion.prismatic = true;
  insertion.kp = 0.15;
  insertion.kd = 0.012;
  insertion.dac_limit_counts = 2000;
  insertion.truth_resolution = 5e-6;
  robot.joints[0].range = {20.0 * kDeg, 60.0 * kDeg, 1.1 * kDeg, 3.0 * kDeg};
  robot.joints[1].range = {55.0 * kDeg, 110.0 * kDeg, 1.5 * kDeg, 4.0 * kDeg};
  robot.joints[2].range = {0.33, 0.42, 0.0025, 0.007};
  robot.coupling(1, 0) = -0.14545;
  robot.coupling(2, 0) = -0.0077973826;
  robot.coupling(2, 1) = -0.008077387;
  for (NominalJoint& joint : robot.joints) draw_cable_and_friction(joint, random);
  return robot;
}

NominalRobot draw_axis(Random& random) {
  NominalRobot robot;
  robot.name = "axis";
  robot.gravity = {9.81, 0.0, 0.0};  // the pendulum hangs at q = 0
  NominalJoint j = rotary("pitch", 121.522074965, random.uniform(0.4, 0.9),
                          {random.uniform(0.15, 0.3), 0.0, 0.0}, {0.01, 0.01, 0.03});
  j.range = {random.uniform(-50.0, -35.0) * kDeg, random.uniform(35.0, 50.0) * kDeg, 1.5 * kDeg,
             5.0 * kDeg};
  draw_cable_and_friction(j, random);
  robot.joints = {j};
  return robot;
}

Chain chain_of(const NominalRobot& robot) {
  std::vector<ChainLink> links(robot.joints.size());
  for (std::size_t i = 0; i < links.size(); ++i) {
    const NominalJoint& joint = robot.joints[i];
    links[i].prismatic = joint.prismatic;
    links[i].mass_kg = joint.mass_kg;
    links[i].com_m = joint.com_m;
    links[i].inertia_kg_m2 = joint.inertia_kg_m2;
  }
  if (links.size() == 3) {  // gold arm of RAVEN-II: La12 = 75 deg, La23 = 52 deg
    links[0].theta_rad = 205.0 * kDeg;
    links[1].alpha_rad = 75.0 * kDeg;
    links[1].theta_rad = 180.0 * kDeg;
    links[2].alpha_rad = 128.0 * kDeg;
    links[2].theta_rad = 90.0 * kDeg;
  }
  return {links, robot.gravity};
}

void draw_ways(NominalRobot& robot, Random& random) {
  robot.says_ways = random.uniform() < 0.5;
  for (std::size_t i = 1; i < robot.joints.size(); ++i)
    robot.joints[i].follows_links = random.uniform() < 0.5;
}

Session exact_session(const NominalRobot& robot) {
  Session session;
  session.believed_coupling = robot.coupling;
  session.robot.coupling = robot.coupling;
  session.robot.chain = chain_of(robot);
  session.truth_period_s = robot.truth_period_s;
  session.truth_latency_s = robot.truth_latency_s;
  session.cycles_per_row = static_cast<int>(std::lround(1000.0 / robot.row_rate_hz));
  session.with_noise = false;
  for (const NominalJoint& n : robot.joints) {
    JointPhysics p;
    p.name = n.name;
    p.prismatic = n.prismatic;
    p.reduction = n.reduction;
    p.gearbox_ratio = n.gearbox_ratio;
    p.motor_inertia = n.motor_inertia_kg_m2 * n.reduction * n.reduction;
    p.follows_links = n.follows_links;
    p.viscous = n.viscous;
    const double short_bristle = n.prismatic ? kShortBristlePrismatic : kShortBristle;
    p.motor_friction.level = n.coulomb;
    p.motor_friction.stribeck_extra = n.stribeck_extra;
    p.motor_friction.stribeck_velocity = n.stribeck_velocity;
    p.motor_friction.displacement = n.presliding > 0.0 ? n.presliding : short_bristle;
    p.motor_friction.damping = n.prismatic ? 1500.0 : 10.0;
    p.joint_friction.level = n.joint_friction;
    p.joint_friction.displacement =
        n.joint_presliding > 0.0 ? n.joint_presliding : 2.0 * short_bristle;
    p.joint_friction.damping = n.prismatic ? 30.0 : 0.8;
    const double rigid = n.prismatic ? kRigidPrismatic : kRigid;
    p.cable.stiffness = n.stiffness > 0.0 ? n.stiffness : rigid;
    p.cable.damping = n.cable_damping > 0.0 ? n.cable_damping : (n.prismatic ? 100.0 : 8.0);
    session.robot.joints.push_back(p);
    JointSession s;
    s.kp = n.kp;
    s.kd = n.kd;
    s.dac_counts_per_n_m = n.dac_counts_per_n_m;
    s.dac_limit_counts = n.dac_limit_counts;
    s.truth_resolution = n.truth_resolution;
    s.range = n.range;
    session.joints.push_back(s);
  }
  return session;
}

void add_noise(Session& session, Random& random) {
  session.with_noise = true;
  session.truth_clock_error = 3e-6 * (2.0 * random.uniform() - 1.0);
  session.lost_truth = 5e-4;
  session.truth_latency_deviation_s = 0.0015;
  for (std::size_t i = 0; i < session.joints.size(); ++i) {
    JointSession& joint = session.joints[i];
    const bool p = session.robot.joints[i].prismatic;
    const double loudness = random.log_uniform(0.7, 1.4);
    joint.white = loudness * (p ? 1.0e-5 : 1.4e-4);
    joint.coloured = loudness * (p ? 1.6e-5 : 2.1e-4);
    joint.walk_per_root_s = loudness * (p ? 3e-7 : 4e-6);
    joint.disturbance = loudness * (p ? 0.3 : 0.03);
    joint.friction_wander = 0.03;
    session.robot.joints[i].motor_friction.spread = random.uniform(0.0, 0.6);
    // At usual stretch the cable is up to 3 % stiffer than at none: sinh(x) / x = 1 + x^2 / 6.
    const double usual = (p ? 4.0 : 2.0) / session.robot.joints[i].cable.stiffness;
    session.robot.joints[i].cable.stiffening = usual / random.uniform(0.1, 0.42);
  }
}

NominalRobot within_tolerance(const NominalRobot& nominal, Random& random) {
  NominalRobot truth = nominal;
  const auto off = [&random] { return 1.0 + 0.8 * kTolerance * (2.0 * random.uniform() - 1.0); };
  const double weight = off();
  truth.truth_latency_s *= off();
  for (NominalJoint& joint : truth.joints) {
    joint.mass_kg *= weight;  // of the whole arm: postures weigh as the plant says, scaled
    for (double* value :
         {&joint.motor_inertia_kg_m2, &joint.stiffness, &joint.cable_damping, &joint.joint_friction,
          &joint.joint_presliding, &joint.coulomb, &joint.viscous, &joint.stribeck_extra,
          &joint.stribeck_velocity, &joint.presliding}) {
      *value *= off();
    }
  }
  return truth;
}

double typical_floor(bool prismatic, bool effort) {
  if (effort) return prismatic ? 0.6 : 0.07;
  return prismatic ? 1.9e-5 : 2.6e-4;
}

}  // namespace ravencal::prove
