// SPDX-License-Identifier: Apache-2.0
//
// Kinds of hidden effects that neither the vocabulary nor the plant's parameters could describe as
// well (beyond.hpp measures that). A hardening cable, a stiffness that differs by direction and a
// drag that grows with the square of the speed are not here: at loads and speeds that this robot
// bears they are a stiffness, an offset and a viscous friction to within the floor.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prove/generator/subject.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;

void joint_with_another(Subject& s, std::size_t joints, Random& random) {
  joint_after_another(s, joints, random);
  s.from = s.joint == 2 ? random.below(2) : 1 - s.joint;
}

void draw_place(const Draw& d) {
  d.details["centre"] = d.place;
  d.details["width"] = d.width;
  d.to.position = {{d.place - 1.2 * d.width, d.place + 1.2 * d.width}};
}
void draw_slow_wave(const Draw& d) { d.details["frequency_hz"] = 0.3 + 1.2 * d.share; }

double sine_rms(const Setting&) { return std::sqrt(0.5); }
double hill_rms(const Setting& x) {
  return std::sqrt(1.25 * x.subject.details.at("width") / std::max(x.motion.span, 1e-9));
}

Hill hill_of(const Truth& t, double height) {
  return {height, t.detail("centre"), t.detail("width")};
}
auto slow_wave(const Truth& t) {
  return [size = t.size, hz = t.detail("frequency_hz")](double t_s, const auto&...) {
    return size * std::sin(2.0 * std::numbers::pi * hz * t_s);
  };
}
auto warm_up(const Truth& t) {
  return [size = t.size, time_s = t.detail("time_s")](double t_s) {
    return size * std::exp(-std::max(0.0, t_s) / time_s);
  };
}
/// Posture bends the link between encoder and joint in proportion to the distance of both joints
/// from their centres.
auto bend(const Truth& t) {
  return
      [size = t.signed_size, i = static_cast<Index>(t.subject.joint), centre = t.detail("centre"),
       from = static_cast<Index>(*t.subject.from), centre_from = t.detail("centre_from")](
          double, const Vector3d& q) { return size * (q[i] - centre) * (q[from] - centre_from); };
}

constexpr std::array<SubjectKind, 7> kOutsideKinds = {{
    {{"local_bump", kTransmission, "", kOutside},
     {.draw = draw_place,
      .unit_rms = hill_rms,
      .apply = [](const Truth& t) { t.cable.bump = hill_of(t, t.signed_size); }}},
    {{"bending_arm", kTransmission, "", kOutside, {}, 'r'},
     {.choose = joint_after_another,
      .draw =
          [](const Draw& d) {
            d.details["centre"] = d.motion.centre;
            d.details["centre_from"] = d.other().centre;
          },
      // Of two joints that move evenly over their spans.
      .unit_rms = [](const Setting& x) { return x.motion.span * x.other().span / 12.0; },
      .apply = [](const Truth& t) { t.recorded.added_truth.emplace_back(bend(t)); }}},
    {{"truth_sway", kSensor, "", kOutside},
     {.draw = draw_slow_wave,
      .unit_rms = sine_rms,
      .apply = [](const Truth& t) { t.recorded.added_truth.emplace_back(slow_wave(t)); }}},
    {{"local_friction", kDrive, "", kOutside},
     {.draw = draw_place,
      .unit_rms = hill_rms,
      .apply = [](const Truth& t) { t.dry.local = hill_of(t, t.size); }}},
    {{"wrong_joint_load", kDrive, "", kOutside, {0.8, 8.0}, 'r'},
     {.choose = joint_with_another,
      .unit_rms = [](const Setting& x) { return std::max(x.other().weight_rms, 0.05); },
      .apply =
          [](const Truth& t) {
            t.joint.leak = {t.signed_size, static_cast<Index>(*t.subject.from)};
          }}},
    {{"hum", kDrive, "", kOutside},
     {.draw = draw_slow_wave,
      .unit_rms = sine_rms,
      .apply = [](const Truth& t) { t.recorded.added_effort.emplace_back(slow_wave(t)); }}},
    {{"friction_warm_up", kDrive, "", kOutside},
     {.draw = [](const Draw& d) { d.details["time_s"] = d.duration_s * (0.2 + 0.2 * d.share); },
      .unit_rms = [](const Setting& x) { return 0.4 * x.joint.coulomb; },
      .apply = [](const Truth& t) { t.recorded.added_friction.emplace_back(warm_up(t)); }}},
}};

}  // namespace

std::span<const SubjectKind> outside_kinds() { return kOutsideKinds; }

}  // namespace ravencal::prove
