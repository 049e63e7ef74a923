// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/subject.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace ravencal::prove {
namespace {

using Eigen::Index;

constexpr std::array<SubjectKind, 27> kVocabulary = {{
    {"homing_offset", "transmission", "offset", false, true},
    {"gain_error", "transmission", "ratio", false, true},
    {"coupling", "transmission", "error", false, true, false, 'r'},
    {"compliance", "transmission", "compliance", false, true},
    {"backlash", "transmission", "half_width", false, true, false, 'a'},
    {"joint_friction", "transmission", "stretch", false, true},
    {"hysteresis", "transmission", "", false, true, true},
    {"creep", "transmission", "compliance", false, true, true},
    {"eccentricity", "transmission", "amplitude", false, true},
    {"slip", "transmission", "size", false, true},
    {"coulomb_friction", "drive", "level"},
    {"viscous_friction", "drive", "damping", false, false, true},
    {"stribeck_friction", "drive", "extra", false, false, true},
    {"presliding", "drive", "displacement", false, false, true},
    {"asymmetric_friction", "drive", ""},
    {"load_dependent_friction", "drive", "load_share", false, false, false, 'a'},
    {"torque_constant", "drive", "ratio"},
    {"torque_ripple", "drive", "amplitude"},
    {"saturation", "drive", "", false, false, true},
    {"controller_gain", "command", "ratio"},
    {"gravity", "drive", "", false, false, false, 'a'},
    {"payload", "drive", ""},
    {"flexible_mode", "drive", "", false, false, true},
    {"delay", "sensor", "delay", false, true},
    {"lost_counts", "sensor", "", false, true},
    {"thermal_drift", "transmission", "final", false, true},
    {"input_disturbance", "command", "size"},
}};

// None that the vocabulary or the plant's parameters could describe as well (beyond.hpp measures
// that). A hardening cable, a stiffness that differs by direction and a drag that grows with the
// square of the speed are not here: at loads and speeds that this robot bears they are a stiffness,
// an offset and a viscous friction to within the floor.
constexpr std::array<SubjectKind, 7> kOutside = {{
    {"local_bump", "transmission", "", true, true},
    {"bending_arm", "transmission", "", true, true, false, 'r'},
    {"truth_sway", "sensor", "", true, true},
    {"local_friction", "drive", "", true},
    {"wrong_joint_load", "drive", "", true, false, false, 'r'},
    {"hum", "drive", "", true},
    {"friction_warm_up", "drive", "", true},
}};

}  // namespace

std::span<const SubjectKind> vocabulary_kinds() { return kVocabulary; }
std::span<const SubjectKind> outside_kinds() { return kOutside; }

std::vector<MotionFigures> motion_figures(const NominalRobot& robot, MotionKind motion,
                                          double duration_s, std::uint64_t motion_seed) {
  constexpr double kStep = 0.02;
  const Chain chain = chain_of(robot);
  std::vector<Path> paths;
  for (const NominalJoint& joint : robot.joints)
    paths.emplace_back(joint.range, motion, duration_s + 1.0, Random(motion_seed, joint.name));
  const auto rows = static_cast<Index>(duration_s / kStep);
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(rows, 3), weight = q;
  for (Index r = 0; r < rows; ++r) {
    for (std::size_t j = 0; j < paths.size(); ++j)
      q(r, static_cast<Index>(j)) = paths[j].at(static_cast<double>(r) * kStep);
    weight.row(r) = chain.weight(q.row(r).transpose()).transpose();
  }
  std::vector<MotionFigures> figures(paths.size());
  for (std::size_t j = 0; j < paths.size(); ++j) {
    const auto c = static_cast<Index>(j);
    MotionFigures& f = figures[j];
    const Eigen::VectorXd v = (q.col(c).tail(rows - 1) - q.col(c).head(rows - 1)) / kStep;
    const Eigen::VectorXd a = (v.tail(rows - 2) - v.head(rows - 2)) / kStep;
    const auto rms = [](const auto& x) {
      return std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
    };
    f.position_rms = rms(q.col(c));
    f.velocity_rms = rms(v);
    f.acceleration_rms = rms(a);
    f.travel = v.cwiseAbs().sum() * kStep;
    f.span = q.col(c).maxCoeff() - q.col(c).minCoeff();
    f.centre = q.col(c).mean();
    f.weight_rms = rms(weight.col(c));
    f.weight_most = weight.col(c).cwiseAbs().maxCoeff();
    f.weight_span = weight.col(c).maxCoeff() - weight.col(c).minCoeff();
    double last = 0.0;
    for (Index r = 0; r + 1 < rows; ++r) {
      if (v[r] * last < 0.0) f.reversals += 1.0;
      if (v[r] != 0.0) last = v[r];
    }
  }
  return figures;
}

Subject draw_subject(const SubjectKind& kind, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double duration_s, Random& random) {
  Subject s;
  s.kind = &kind;
  const bool pair =
      kind.id == "coupling" || kind.id == "wrong_joint_load" || kind.id == "bending_arm";
  const std::size_t count = robot.joints.size();
  s.joint = pair ? 1 + random.below(count - 1) : random.below(count);
  // Loads need a joint that carries weight, and a tool's weight is felt by the first two.
  if (kind.id == "payload" || kind.id == "creep" || kind.id == "hysteresis" ||
      kind.id == "compliance") {
    s.joint = count > 1 ? random.below(2) : 0;
  }
  s.from = pair ? random.below(s.joint) : 0;
  if (kind.id == "wrong_joint_load") s.from = s.joint == 2 ? random.below(2) : 1 - s.joint;
  const NominalJoint& joint = robot.joints[s.joint];
  const MotionFigures& f = figures[s.joint];
  const double pulley = joint.reduction / joint.gearbox_ratio;
  s.details["phase_rad"] = random.uniform(0.0, 6.28);
  const double place = f.centre + f.span * random.uniform(-0.2, 0.2);
  const double at_s = duration_s * random.uniform(0.3, 0.7);
  const double width = f.span * random.uniform(0.06, 0.12);
  const double sign = random.sign();
  const double time_share = random.uniform();
  s.details["sign"] = sign;
  if (kind.id == "eccentricity") s.details["order"] = pulley;
  if (kind.id == "torque_ripple")
    s.details["order"] = pulley * (2.0 + 2.0 * std::floor(2.0 * time_share));
  if (kind.id == "creep") s.details["time_s"] = 3.0 * std::pow(10.0, time_share);
  if (kind.id == "thermal_drift") s.details["time_s"] = duration_s * (0.25 + 0.5 * time_share);
  if (kind.id == "friction_warm_up") s.details["time_s"] = duration_s * (0.2 + 0.2 * time_share);
  if (kind.id == "stribeck_friction") s.details["velocity"] = joint.stribeck_velocity;
  if (kind.id == "flexible_mode") s.details["frequency_hz"] = 4.0 + 6.0 * time_share;
  if (kind.id == "bending_arm") {
    s.details["centre"] = f.centre;
    s.details["centre_from"] = figures[s.from].centre;
  }
  if (kind.id == "hum" || kind.id == "truth_sway")
    s.details["frequency_hz"] = 0.3 + 1.2 * time_share;
  if (kind.id == "saturation") s.details["weight"] = f.weight_most;
  if (kind.id == "hysteresis")
    s.details["yield"] =
        std::max(0.2 * f.weight_span / joint.stiffness, joint.prismatic ? 2e-5 : 5e-4);
  if (kind.id == "slip" || kind.id == "lost_counts") {
    s.details["at_s"] = at_s;
    s.interval_s = {{at_s, duration_s}};
  }
  if (kind.id == "local_bump" || kind.id == "local_friction") {
    s.details["centre"] = place;
    s.details["width"] = width;
    s.position = {{place - 1.2 * width, place + 1.2 * width}};
  }
  if (kind.id == "input_disturbance") {
    double t_s = 5.0 + 10.0 * random.uniform();
    while (t_s < duration_s - 5.0) {
      const double end_s = t_s + random.uniform(0.8, 2.5);
      s.interval_s.emplace_back(t_s, end_s);
      t_s = end_s + random.uniform(8.0, 20.0);
    }
  }
  return s;
}

double unit_size(const Subject& s, const NominalRobot& robot,
                 const std::vector<MotionFigures>& figures, double amplitude) {
  const NominalJoint& joint = robot.joints[s.joint];
  const MotionFigures& f = figures[s.joint];
  const std::string_view id = s.kind->id;
  const double load = std::hypot(f.weight_rms, joint.joint_friction);
  const double friction = joint.coulomb + joint.viscous * f.velocity_rms;
  const double filled = std::min(1.0, 2.1 * s.interval_s.size() * 1.0 / 60.0);
  if (id == "gain_error") return f.position_rms;
  if (id == "coupling") return figures[s.from].position_rms;
  if (id == "compliance") return std::max(f.weight_rms, 0.1);
  if (id == "joint_friction") return 1.0;
  if (id == "hysteresis") return 0.5;
  if (id == "creep") return load;
  if (id == "eccentricity" || id == "torque_ripple" || id == "hum" || id == "truth_sway")
    return std::sqrt(0.5);
  if (id == "slip" || id == "lost_counts" || id == "thermal_drift") return 0.5;
  if (id == "viscous_friction" || id == "delay") return f.velocity_rms;
  if (id == "stribeck_friction") return 0.3;
  if (id == "presliding") {  // the friction is soft for twice the displacement after each reversal
    const double share = std::min(1.0, 2.0 * f.reversals * amplitude / std::max(f.travel, 1e-9));
    return 0.5 * friction * std::sqrt(share) / std::max(amplitude, 1e-12);
  }
  if (id == "asymmetric_friction") return friction;
  if (id == "load_dependent_friction") return f.weight_rms;
  if (id == "torque_constant" || id == "controller_gain") return std::hypot(friction, f.weight_rms);
  if (id == "saturation") return 0.2 * (friction + f.weight_rms);
  if (id == "gravity") return f.weight_rms / std::max(joint.mass_kg, 1e-9);
  if (id == "payload") {
    const NominalJoint& last = robot.joints.back();
    return f.weight_rms / std::max(0.6 * (joint.mass_kg + last.mass_kg), 1e-9);
  }
  if (id == "flexible_mode") return f.acceleration_rms;
  if (id == "input_disturbance") return std::sqrt(std::max(0.02, filled));
  if (id == "bending_arm")  // of two joints that move evenly over their spans
    return f.span * figures[s.from].span / 12.0;
  if (id == "local_bump" || id == "local_friction")
    return std::sqrt(1.25 * s.details.at("width") / std::max(f.span, 1e-9));
  if (id == "wrong_joint_load") return std::max(figures[s.from].weight_rms, 0.05);
  if (id == "friction_warm_up") return 0.4 * joint.coulomb;
  return 1.0;  // homing_offset, backlash, coulomb_friction
}

double amplitude_for(const Subject& s, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double rms) {
  const NominalJoint& joint = robot.joints[s.joint];
  const std::string_view id = s.kind->id;
  double amplitude = rms / unit_size(s, robot, figures, 0.0);
  if (id == "presliding") {  // rms grows with the root of the displacement
    const double friction = joint.coulomb + joint.viscous * figures[s.joint].velocity_rms;
    const double share = std::pow(rms / (0.5 * friction), 2);
    amplitude = share * figures[s.joint].travel / (2.0 * std::max(1.0, figures[s.joint].reversals));
  }
  // A gross effect may spoil the fit, not the robot: bounds at which it still follows its command.
  struct Bound {
    std::string_view id;
    double rotary, prismatic;
  };
  constexpr std::array<Bound, 18> kBounds = {{{"gain_error", 0.15, 0.15},
                                              {"coupling", 0.15, 0.02},
                                              {"compliance", 0.012, 1e-4},
                                              {"joint_friction", 0.008, 2e-4},
                                              {"coulomb_friction", 3.0, 25.0},
                                              {"viscous_friction", 25.0, 6000.0},
                                              {"stribeck_friction", 2.0, 12.0},
                                              {"presliding", 0.02, 1e-3},
                                              {"asymmetric_friction", 0.7, 0.7},
                                              {"load_dependent_friction", 0.6, 0.6},
                                              {"torque_constant", 0.4, 0.4},
                                              {"torque_ripple", 1.5, 10.0},
                                              {"saturation", 0.35, 0.35},
                                              {"controller_gain", 0.6, 0.6},
                                              {"payload", 1.0, 1.0},
                                              {"flexible_mode", 0.1, 20.0},
                                              {"input_disturbance", 2.5, 15.0},
                                              {"wrong_joint_load", 0.8, 8.0}}};
  for (const Bound& bound : kBounds) {
    if (bound.id == id)
      amplitude = std::min(amplitude, joint.prismatic ? bound.prismatic : bound.rotary);
  }
  return amplitude;
}

}  // namespace ravencal::prove
