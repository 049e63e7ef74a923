// SPDX-License-Identifier: Apache-2.0
//
// Kinds of hidden effects that diagnose can name. SI units, referred to the joint.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prove/generator/subject.hpp"
#include "prove/generator/term_library.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Joint = NominalJoint;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kMostSaturation = 0.35;

/// Loads need a joint that carries weight, and a tool's weight is felt by the first two.
void loaded_joint(Subject& s, std::size_t joints, Random& random) {
  any_joint(s, joints, random);
  s.joint = joints > 1 ? random.below(2) : 0;
}
void draw_moment(const Draw& d) {
  d.details["at_s"] = d.at_s;
  d.to.interval_s = {{d.at_s, d.duration_s}};
}
void draw_pulses(const Draw& d) {
  double t_s = 5.0 + 10.0 * d.random.uniform();
  while (t_s < d.duration_s - 5.0) {
    const double end_s = t_s + d.random.uniform(0.8, 2.5);
    d.to.interval_s.emplace_back(t_s, end_s);
    t_s = end_s + d.random.uniform(8.0, 20.0);
  }
}
double step_rms(const Setting&) { return 0.5; }
double wave_rms(const Setting&) { return std::sqrt(0.5); }
double usual_friction(const Setting& x) {
  return x.joint.coulomb + x.joint.viscous * x.motion.velocity_rms;
}
double usual_effort(const Setting& x) { return std::hypot(usual_friction(x), x.motion.weight_rms); }
/// The friction is soft for twice the displacement after each reversal: the RMS grows with the root
/// of the displacement.
double displacement_of(const Setting& x, double rms) {
  const double share = std::pow(rms / (0.5 * usual_friction(x)), 2);
  return share * x.motion.travel / (2.0 * std::max(1.0, x.motion.reversals));
}
double pulses_law_rms(const Subject& s, double, double duration_s) {
  double on_s = 0.0;
  for (const auto& [begin_s, end_s] : s.interval_s) on_s += end_s - begin_s;
  return s.amplitude * std::sqrt(on_s / duration_s);
}

void soften(const Truth& t) {
  const double softer = 1.0 / (1.0 / t.cable.stiffness + t.size);
  t.cable.stiffening *= t.cable.stiffness / softer;
  t.cable.damping = std::min(t.cable.damping, 0.01 * softer);
  t.cable.stiffness = softer;
}
/// The limit grows without bound as the amplitude vanishes, so that no effort is clipped.
void saturate(const Truth& t) {
  const double slowly =
      t.dry.level + t.dry.stribeck_extra + t.joint.joint_friction.level + t.detail("weight");
  t.joint.saturation = 0.75 * slowly * (1.0 + 0.25 * std::log(kMostSaturation / t.size));
}
void hang_flexible_mass(const Truth& t) {
  const double omega = 2.0 * 3.14159265358979 * t.detail("frequency_hz");
  t.joint.flexible_inertia = t.size;
  t.joint.flexible_stiffness = t.size * omega * omega;
  t.joint.flexible_damping = 0.06 * t.size * omega;
}
void lose_counts(const Truth& t) {
  const double per_count = kTurn / t.recorded.motor_counts_per_rev / t.joint.reduction;
  t.recorded.lost_counts.emplace_back(t.detail("at_s"), std::lround(t.signed_size / per_count));
}
/// The plant's inertia about the joint already counts the link, wherever its weight is.
void weigh_link(const Truth& t) {
  ChainLink& link = t.session.robot.chain.links()[t.subject.joint];
  link.mass_kg += t.size;
  link.inertia_kg_m2[2] = std::max(1e-4, link.inertia_kg_m2[2] - t.size * link.com_m.squaredNorm());
}
void weigh_tool(const Truth& t) {
  std::vector<ChainLink>& links = t.session.robot.chain.links();
  ChainLink& last = links.back();
  const double whole = last.mass_kg + t.size;
  last.com_m *= last.mass_kg / whole;
  if (links.size() == 1) last.com_m += Vector3d(0.3, 0.0, 0.0) * (t.size / whole);
  last.mass_kg = whole;
}

Wave wave_of(const Truth& t) { return {t.size, t.detail("order"), t.detail("phase_rad")}; }
auto slip(const Truth& t) {
  return [size = t.signed_size, at_s = t.detail("at_s")](double t_s) {
    return size * std::clamp((t_s - at_s) / 0.03, 0.0, 1.0);
  };
}
auto drift(const Truth& t) {
  return [size = t.signed_size, time_s = t.detail("time_s")](double t_s) {
    return size * (1.0 - std::exp(-std::max(0.0, t_s) / time_s));
  };
}
auto pulses(const Truth& t) {
  return [size = t.signed_size, intervals = t.subject.interval_s](double t_s) {
    const auto on = [t_s](const auto& pulse) { return t_s >= pulse.first && t_s < pulse.second; };
    return std::any_of(intervals.begin(), intervals.end(), on) ? size : 0.0;
  };
}
double pulley(const Joint& joint) { return joint.reduction / joint.gearbox_ratio; }

void add_others(Terms& x) {
  for (std::size_t k = 0; k < x.s.others.size(); ++k)
    if (k != x.number) x.add(x.s.others[k]);
}
void add_lag_behind_weight(Terms& x) {
  Eigen::VectorXd slow(x.s.rows());
  double state = x.s.weight[0];
  for (Index i = 0; i < x.s.rows(); ++i) {
    if (i > 0) state += (x.s.weight[i] - state) * std::min(1.0, (x.t_s[i] - x.t_s[i - 1]) / 10.0);
    slow[i] = state;
  }
  x.add(slow - x.s.weight);
}
void add_steps(Terms& x) {
  for (const double share : {0.35, 0.45, 0.55, 0.65})
    x.add((x.t_s.array() > share * x.whole_s).cast<double>().matrix());
}
void add_stribeck(Terms& x) {
  const auto ratio = x.s.v.array() / (3.0 * x.joint.stribeck_velocity);
  x.add((x.s.side.array() * (-ratio.square()).exp()).matrix());
}

constexpr std::array<SubjectKind, 27> kVocabulary = {{
    {{"homing_offset", kTransmission, "offset", kSigned},
     {.apply = [](const Truth& t) { t.recorded.truth_offset += t.signed_size; },
      .terms = [](Terms& x) { x.add(Eigen::VectorXd::Ones(x.s.rows())); }}},
    {{"gain_error", kTransmission, "ratio", kSigned, {0.15, 0.15}},
     {.unit_rms = [](const Setting& x) { return x.motion.position_rms; },
      .apply = [](const Truth& t) { t.cable.ratio_error += t.signed_size; },
      .terms = [](Terms& x) { x.add(x.s.q); }}},
    {{"coupling", kTransmission, "error", kSigned, {0.15, 0.02}, 'r'},
     {.choose = joint_after_another,
      .unit_rms = [](const Setting& x) { return x.other().position_rms; },
      .apply = [](const Truth& t) { t.coupling() += t.signed_size; },
      .terms = add_others}},
    {{"compliance", kTransmission, "compliance", 0, {0.012, 1e-4}},  // rad per N m, m per N
     {.stated = {{&Joint::stiffness, "stiffness_n_m_per_rad", "stiffness_n_per_m"},
                 {&Joint::cable_damping, "damping_n_m_s_per_rad", "damping_n_s_per_m"}},
      .choose = loaded_joint,
      .unit_rms = [](const Setting& x) { return std::max(x.motion.weight_rms, 0.1); },
      .conceal = [](Joint& j) { j.cable_damping = j.joint_friction = j.joint_presliding = 0.0; },
      .apply = soften,
      .terms = [](Terms& x) { x.add(x.s.weight); }}},
    {{"backlash", kTransmission, "half_width", kAtReversals, {}, 'a'},
     {.apply = [](const Truth& t) { t.cable.gap_half_width += t.size; },
      .terms = [](Terms& x) { x.add(x.s.weight.array().sign().matrix()); }}},
    {{"joint_friction", kTransmission, "stretch", kAtReversals, {0.008, 2e-4}},  // rad, m
     {.stated = {{&Joint::joint_friction, "level_n_m", "level_n"},
                 {&Joint::joint_presliding, "presliding_rad", "presliding_m"}},
      .conceal = [](Joint& j) { j.joint_presliding = 0.0; },
      .apply = [](const Truth& t) { t.joint.joint_friction.level += t.size * t.cable.stiffness; },
      .terms = [](Terms& x) { x.add(play(x.s.q, 4.0 * narrow(x.joint))); }}},
    {{"hysteresis", kTransmission, "", kWantsRich | kAtReversals},
     {.choose = loaded_joint,
      .draw =
          [](const Draw& d) {
            d.details["yield"] = std::max(0.2 * d.motion.weight_span / d.joint.stiffness,
                                          d.joint.prismatic ? 2e-5 : 5e-4);
          },
      .unit_rms = step_rms,
      .apply =
          [](const Truth& t) {
            const double yield = t.detail("yield");
            t.cable.hysteresis = {t.size * t.cable.stiffness / yield, yield};
          },
      .terms = [](Terms& x) { x.add(play(x.s.q, 40.0 * narrow(x.joint))); }}},
    {{"creep", kTransmission, "compliance", kWantsRich},
     {.choose = loaded_joint,
      .draw = [](const Draw& d) { d.details["time_s"] = 3.0 * std::pow(10.0, d.share); },
      .unit_rms =
          [](const Setting& x) { return std::hypot(x.motion.weight_rms, x.joint.joint_friction); },
      .apply =
          [](const Truth& t) {
            t.cable.creep = {t.size, t.detail("time_s")};
          },
      .terms = add_lag_behind_weight}},
    {{"eccentricity", kTransmission, "amplitude"},
     {.draw = [](const Draw& d) { d.details["order"] = pulley(d.joint); },
      .unit_rms = wave_rms,
      .apply = [](const Truth& t) { t.cable.eccentricity = wave_of(t); },
      .terms = [](Terms& x) { x.add(wave(x.s.q, pulley(x.joint))); }}},
    {{"slip", kTransmission, "size", kSigned},
     {.draw = draw_moment,
      .unit_rms = step_rms,
      .apply = [](const Truth& t) { t.recorded.added_length.emplace_back(slip(t)); },
      .terms = add_steps}},
    {{"coulomb_friction", kDrive, "level", kAtReversals, {3.0, 25.0}},  // N m, N
     {.stated = {{&Joint::coulomb, "level_n_m", "level_n"}},
      .conceal = [](Joint& j) { j.stribeck_extra = j.presliding = 0.0; },
      .apply = [](const Truth& t) { t.dry.level += t.size; },
      .terms = [](Terms& x) { x.add(x.s.side); }}},
    {{"viscous_friction", kDrive, "damping", kWantsRich, {25.0, 6000.0}},  // per rad/s, m/s
     {.stated = {{&Joint::viscous, "damping_n_m_s_per_rad", "damping_n_s_per_m"}},
      .unit_rms = [](const Setting& x) { return x.motion.velocity_rms; },
      .apply = [](const Truth& t) { t.joint.viscous += t.size; },
      .terms = [](Terms& x) { x.add(x.s.v); }}},
    {{"stribeck_friction", kDrive, "extra", kWantsRich, {2.0, 12.0}},  // N m, N
     {.stated = {{&Joint::stribeck_extra, "extra_n_m", "extra_n"},
                 {&Joint::stribeck_velocity, "velocity_rad_per_s", "velocity_m_per_s"}},
      .draw = [](const Draw& d) { d.details["velocity"] = d.joint.stribeck_velocity; },
      .unit_rms = [](const Setting&) { return 0.3; },
      .apply =
          [](const Truth& t) {
            t.dry.stribeck_extra += t.size;
            t.dry.stribeck_velocity = t.detail("velocity");
          },
      .terms = add_stribeck}},
    {{"presliding", kDrive, "displacement", kWantsRich | kAtReversals, {0.02, 1e-3}},  // rad, m
     {.stated = {{&Joint::presliding, "displacement_rad", "displacement_m"}},
      .amplitude = displacement_of,
      .apply = [](const Truth& t) { t.dry.displacement += t.size; },
      .terms = [](Terms& x) { x.add(play(x.s.q, 10.0 * narrow(x.joint)) - x.s.side); }}},
    {{"asymmetric_friction", kDrive, "", kAtReversals, {0.7, 0.7}},
     {.unit_rms = usual_friction,
      .apply = [](const Truth& t) { t.dry.asymmetry = t.signed_size; },
      .terms = [](Terms& x) { x.add(x.s.side.cwiseAbs()); }}},
    {{"load_dependent_friction", kDrive, "load_share", 0, {0.6, 0.6}, 'a'},
     {.unit_rms = [](const Setting& x) { return x.motion.weight_rms; },
      .apply = [](const Truth& t) { t.dry.load_share += t.size; },
      .terms = [](Terms& x) { x.add(x.s.side.cwiseProduct(x.s.weight.cwiseAbs())); }}},
    {{"torque_constant", kDrive, "ratio", kSigned, {0.4, 0.4}},
     {.unit_rms = usual_effort,
      .apply = [](const Truth& t) { t.joint.torque_ratio = t.signed_size; },
      .terms = [](Terms& x) { x.add(x.known); }}},
    {{"torque_ripple", kDrive, "amplitude", 0, {1.5, 10.0}},  // N m, N
     {.draw =
          [](const Draw& d) {
            d.details["order"] = pulley(d.joint) * (2.0 + 2.0 * std::floor(2.0 * d.share));
          },
      .unit_rms = wave_rms,
      .apply = [](const Truth& t) { t.joint.ripple = wave_of(t); },
      .terms = [](Terms& x) { x.add(wave(x.s.q, 2.0 * pulley(x.joint))); }}},
    {{"saturation", kDrive, "", kWantsRich, {kMostSaturation, kMostSaturation}},
     {.draw = [](const Draw& d) { d.details["weight"] = d.motion.weight_most; },
      .unit_rms = [](const Setting& x) { return 0.2 * (usual_friction(x) + x.motion.weight_rms); },
      .apply = saturate}},
    {{"controller_gain", kCommand, "ratio", kSigned | kFactor, {0.6, 0.6}},
     {.unit_rms = usual_effort,
      .apply = [](const Truth& t) { t.recorded.kp *= 1.0 + t.signed_size; },
      .law_rms = [](const Subject& s, double effort, double) { return s.amplitude * effort; }}},
    {{"gravity", kDrive, "", 0, {}, 'a'},
     {.stated = {{&Joint::mass_kg}},
      .unit_rms =
          [](const Setting& x) { return x.motion.weight_rms / std::max(x.joint.mass_kg, 1e-9); },
      .conceal = [](Joint& j) { j.inertia_kg_m2[2] += j.mass_kg * j.com_m.squaredNorm(); },
      .apply = weigh_link,
      .terms = [](Terms& x) { x.add(wave(x.s.q, 1.0)); }}},
    {{"payload", kDrive, "", kEverywhere, {1.0, 1.0}},  // kg
     {.choose = loaded_joint,
      .unit_rms =
          [](const Setting& x) {
            const double kg = x.joint.mass_kg + x.robot.joints.back().mass_kg;
            return x.motion.weight_rms / std::max(0.6 * kg, 1e-9);
          },
      .apply = weigh_tool}},
    {{"flexible_mode", kDrive, "", kWantsRich, {0.1, 20.0}},  // kg m^2, kg
     {.draw = [](const Draw& d) { d.details["frequency_hz"] = 4.0 + 6.0 * d.share; },
      .unit_rms = [](const Setting& x) { return x.motion.acceleration_rms; },
      .apply = hang_flexible_mass}},
    {{"delay", kSensor, "delay"},
     {.unit_rms = [](const Setting& x) { return x.motion.velocity_rms; },
      .apply = [](const Truth& t) { t.recorded.truth_delay_s += t.size; },
      .terms = [](Terms& x) { x.add(x.s.v); }}},
    {{"lost_counts", kSensor, ""},
     {.draw = draw_moment, .unit_rms = step_rms, .apply = lose_counts}},
    {{"thermal_drift", kTransmission, "final", kSigned},
     {.draw = [](const Draw& d) { d.details["time_s"] = d.duration_s * (0.25 + 0.5 * d.share); },
      .unit_rms = step_rms,
      .apply = [](const Truth& t) { t.recorded.added_length.emplace_back(drift(t)); },
      .terms = [](Terms& x) { x.add((1.0 - (-3.0 * x.t_s.array() / x.whole_s).exp()).matrix()); }}},
    {{"input_disturbance", kCommand, "size", kSigned, {2.5, 15.0}},  // N m, N
     {.draw = draw_pulses,
      .unit_rms =
          [](const Setting& x) {
            const auto count = static_cast<double>(x.subject.interval_s.size());
            return std::sqrt(std::max(0.02, std::min(1.0, 2.1 * count / 60.0)));
          },
      .apply = [](const Truth& t) { t.recorded.added_input.emplace_back(pulses(t)); },
      .law_rms = pulses_law_rms}},
}};

}  // namespace

std::span<const SubjectKind> vocabulary_kinds() { return kVocabulary; }

}  // namespace ravencal::prove
