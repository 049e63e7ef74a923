// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "prove/generator/subject.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;

constexpr double kMostSaturation = 0.35;  // amplitude_for() gives no more

void apply_transmission(const Subject& s, double a, const NominalJoint& nominal, Session& session) {
  const std::string_view id = s.kind->id;
  const double sign = s.details.at("sign");
  JointPhysics& p = session.robot.joints[s.joint];
  JointSession& j = session.joints[s.joint];
  CablePhysics& cable = p.cable;
  if (id == "homing_offset") j.truth_offset += sign * a;
  if (id == "gain_error") cable.ratio_error += sign * a;
  if (id == "coupling")
    session.robot.coupling(static_cast<Index>(s.joint), static_cast<Index>(s.from)) += sign * a;
  if (id == "compliance") {
    const double softer = 1.0 / (1.0 / cable.stiffness + a);
    cable.stiffening *= cable.stiffness / softer;
    cable.damping = std::min(cable.damping, 0.01 * softer);
    cable.stiffness = softer;
  }
  if (id == "backlash") cable.gap_half_width += a;
  if (id == "joint_friction") p.joint_friction.level += a * cable.stiffness;
  if (id == "hysteresis") {
    cable.hysteresis_yield = s.details.at("yield");
    cable.hysteresis_stiffness = a * cable.stiffness / cable.hysteresis_yield;
  }
  if (id == "creep") {
    cable.creep_compliance = a;
    cable.creep_time_s = s.details.at("time_s");
  }
  if (id == "eccentricity")
    cable.eccentricity = {a, s.details.at("order"), s.details.at("phase_rad")};
  if (id == "slip") j.slips.emplace_back(s.details.at("at_s"), sign * a);
  if (id == "lost_counts") {
    const double per_count = 2.0 * 3.14159265358979 / j.motor_counts_per_rev / nominal.reduction;
    j.lost_counts.emplace_back(s.details.at("at_s"),
                               static_cast<long>(std::lround(sign * a / per_count)));
  }
  if (id == "delay") j.truth_delay_s += a;
  if (id == "thermal_drift") {
    j.drift = sign * a;
    j.drift_time_s = s.details.at("time_s");
  }
  if (id == "bending_arm")
    j.bend = {sign * a, s.from, s.details.at("centre"), s.details.at("centre_from")};
  if (id == "truth_sway") {
    j.sway = a;
    j.sway_hz = s.details.at("frequency_hz");
  }
  if (id == "local_bump") cable.bump = {sign * a, s.details.at("centre"), s.details.at("width")};
}

void apply_drive(const Subject& s, double a, Session& session) {
  const std::string_view id = s.kind->id;
  const double sign = s.details.at("sign");
  JointPhysics& p = session.robot.joints[s.joint];
  JointSession& j = session.joints[s.joint];
  DryFriction& dry = p.motor_friction;
  if (id == "coulomb_friction") dry.level += a;
  if (id == "viscous_friction") p.viscous += a;
  if (id == "stribeck_friction") {
    dry.stribeck_extra += a;
    dry.stribeck_velocity = s.details.at("velocity");
  }
  if (id == "presliding") dry.displacement += a;
  if (id == "asymmetric_friction") dry.asymmetry = sign * a;
  if (id == "load_dependent_friction") dry.load_share += a;
  if (id == "torque_constant") p.torque_ratio = sign * a;
  if (id == "torque_ripple") p.ripple = {a, s.details.at("order"), s.details.at("phase_rad")};
  if (id == "saturation") {
    // The limit grows without bound as the amplitude vanishes, so that no effort is clipped.
    const double slowly =
        dry.level + dry.stribeck_extra + p.joint_friction.level + s.details.at("weight");
    p.saturation = 0.75 * slowly * (1.0 + 0.25 * std::log(kMostSaturation / a));
  }
  if (id == "controller_gain") j.kp *= 1.0 + sign * a;
  if (id == "flexible_mode") {
    const double omega = 2.0 * 3.14159265358979 * s.details.at("frequency_hz");
    p.flexible_inertia = a;
    p.flexible_stiffness = a * omega * omega;
    p.flexible_damping = 0.06 * a * omega;
  }
  if (id == "input_disturbance") {
    for (const auto& [begin_s, end_s] : s.interval_s)
      j.pulses.push_back({begin_s, end_s, sign * a});
  }
  if (id == "local_friction") {
    dry.local_extra = a;
    dry.local_centre = s.details.at("centre");
    dry.local_width = s.details.at("width");
  }
  if (id == "wrong_joint_load") {
    p.tension_leak = sign * a;
    p.leak_from = static_cast<int>(s.from);
  }
  if (id == "hum") {
    j.hum = a;
    j.hum_hz = s.details.at("frequency_hz");
  }
  if (id == "friction_warm_up") {
    j.friction_warm_up = a;
    j.warm_up_time_s = s.details.at("time_s");
  }
}

/// Mass that the plant does not know, at the place of the link's own or at the tool.
void apply_mass(const Subject& s, double a, Session& session) {
  std::vector<ChainLink> links = session.robot.chain.links();
  if (s.kind->id == "gravity") {
    links[s.joint].mass_kg += a;
    // The plant's inertia about the joint already counts the link, wherever its weight is.
    links[s.joint].inertia_kg_m2[2] =
        std::max(1e-4, links[s.joint].inertia_kg_m2[2] - a * links[s.joint].com_m.squaredNorm());
  }
  if (s.kind->id == "payload") {
    ChainLink& last = links.back();
    const double whole = last.mass_kg + a;
    last.com_m *= last.mass_kg / whole;
    if (links.size() == 1) last.com_m += Vector3d(0.3, 0.0, 0.0) * (a / whole);
    last.mass_kg = whole;
  }
  session.robot.chain = Chain(std::move(links), session.robot.chain.gravity());
}

}  // namespace

void conceal(const Subject& subject, NominalRobot& nominal) {
  NominalJoint& joint = nominal.joints[subject.joint];
  const std::string_view id = subject.kind->id;
  if (id == "compliance") {
    joint.stiffness = joint.cable_damping = 0.0;
    joint.joint_friction = joint.joint_presliding = 0.0;
  }
  if (id == "joint_friction") joint.joint_friction = joint.joint_presliding = 0.0;
  if (id == "coulomb_friction") joint.coulomb = joint.stribeck_extra = joint.presliding = 0.0;
  if (id == "viscous_friction") joint.viscous = 0.0;
  if (id == "stribeck_friction") joint.stribeck_extra = 0.0;
  if (id == "presliding") joint.presliding = 0.0;
  if (id == "gravity") {
    joint.inertia_kg_m2[2] += joint.mass_kg * joint.com_m.squaredNorm();
    joint.mass_kg = 0.0;
  }
}

void apply(const Subject& subject, double amplitude, const NominalRobot& nominal,
           Session& session) {
  if (amplitude == 0.0) return;
  const NominalJoint& joint = nominal.joints[subject.joint];
  if (subject.kind->id == "gravity" || subject.kind->id == "payload")
    apply_mass(subject, amplitude, session);
  else if (subject.kind->in_truth)
    apply_transmission(subject, amplitude, joint, session);
  else
    apply_drive(subject, amplitude, session);
}

}  // namespace ravencal::prove
