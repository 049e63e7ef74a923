// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnose/findings/policy.hpp"
#include "diagnose/vocabulary/candidates.hpp"
#include "diagnose/vocabulary/setters.hpp"
#include "physics/drives.hpp"
#include "physics/tolerance_keys.hpp"

namespace ravencal::diagnose {
namespace {

using physics::JointCircumstances;

/// How far a cable without compliance is stretched when the controller takes a stop for reached, no
/// plant says: in quanta of the encoder.
constexpr double kHomedQuanta = 7.0;
/// Numbers of a simulation's form, relative to the plant's: presliding, of a drive whose plant
/// states none, and the damping of bristles.
constexpr double kPreslidingForm = 0.5;
constexpr double kUnstatedPreslidingForm = 1.0;
constexpr double kBristleDampingForm = 0.6;
/// How late efforts are logged: filters, buses and drives' own averages.
constexpr double kEffortDelayS = 0.005;
/// Deviation of the motor's constant effort over its friction, which no plant states.
constexpr double kEffortOffset = 0.006;
/// The law is software, but how it differentiates is not stated.
constexpr double kLawDeviation = 0.02;
constexpr double kLawRateDeviation = 0.1;
constexpr double kDesiredRateDeviation = 0.5;
constexpr double kLinkShareDeviation = 0.4;
constexpr double kDelayScale_s = 0.1;
/// What is positive keeps so much of the plant's number.
constexpr double kLeastRatio = -0.998;

class Numbers {
 public:
  Numbers(const physics::Plant& plant, const Scales& scales, std::vector<Parameter>& out)
      : plant_(plant), joint_(plant.joints[scales.joint]), s_(scales), out_(out) {}

  /// A positive number of the plant; nothing where it has none.
  void of_plant(const std::string& effect, const std::string& parameter, Reaches reaches) {
    const double value = joint_.parameter(effect, parameter);
    if (value <= 0.0) return;
    out_.push_back(positive(effect, parameter, value, deviation(effect, parameter), reaches));
  }

  void cable() {
    if (const double stiffness = joint_.parameter("compliance", "stiffness");
        stiffness > 0.0 && s_.truth) {
      Parameter p = positive("compliance", "compliance", 1.0 / stiffness,
                             deviation("compliance", "stiffness"), Reaches::kCable);
      p.unit = unit_of("creep", "compliance", s_.prismatic);
      p.set = as_compliance(s_.joint);
      out_.push_back(std::move(p));
    }
    of_plant("joint_friction", "level", Reaches::kCable);
    form("joint_friction", "presliding", kPreslidingForm, Reaches::kCable);
    if (!s_.truth) return;
    of_plant("backlash", "half_width", Reaches::kCable);
    for (const char* part : {"stiffness", "yield"}) of_plant("hysteresis", part, Reaches::kCable);
    for (const char* part : {"compliance", "time"}) of_plant("creep", part, Reaches::kCable);
    signed_number("eccentricity", "amplitude", Reaches::kCable);
    signed_number("gain_error", "ratio", Reaches::kCable);
    signed_number("thermal_drift", "final", Reaches::kCable);
  }

  void mass() {
    if (!s_.weight || joint_.link.mass_kg <= 0.0) return;
    Parameter p = ratio("gravity", deviation("gravity", "weight_scale"), Reaches::kLinkLoad);
    p.set = relative([](auto& joint) -> auto& { return joint.link.mass_kg; });
    out_.push_back(std::move(p));
  }

  void drive() {
    Parameter inertia =
        ratio("inertia_error", deviation("inertia_error", "inertia"), Reaches::kDrive);
    inertia.set = relative([](auto& joint) -> auto& { return joint.motor_inertia_kg_m2; });
    out_.push_back(std::move(inertia));
    Parameter torque =
        ratio("torque_constant", deviation("torque_constant", "ratio"), Reaches::kDrive);
    torque.nominal = joint_.parameter("torque_constant", "ratio");
    torque.low -= torque.nominal;
    out_.push_back(std::move(torque));
    either_sign("effort_offset", "offset", s_.load, kEffortOffset, Reaches::kDrive);
    of_plant("coulomb_friction", "level", Reaches::kDrive);
    of_plant("viscous_friction", "damping", Reaches::kDrive);
    of_plant("load_dependent_friction", "load_share", Reaches::kDrive);
    for (const char* part : {"extra", "velocity"})
      of_plant("stribeck_friction", part, Reaches::kDrive);
    for (const char* part : {"level_difference", "damping_difference"})
      signed_number("asymmetric_friction", part, Reaches::kDrive);
    signed_number("torque_ripple", "amplitude", Reaches::kDrive);
    presliding();
    form("presliding", "damping", kBristleDampingForm, Reaches::kDrive);
    if (joint_.find_effect("presliding") == nullptr) unstated_presliding();
    out_.push_back(recorded("effort", "late", 1.0, kEffortDelayS, Reaches::kDrive,
                            &JointCircumstances::effort_lateness_s));
  }

  void encoder(std::size_t recordings) {
    delay();
    const double stated = joint_.parameter("homing_offset", "deviation");
    const double homed = std::max({s_.quantum, stated, stretch_at_stop()});
    for (std::size_t r = 0; r < recordings; ++r) {
      Parameter constant = recorded("encoder", "constant", 1.0, homed, Reaches::kPosition,
                                    &JointCircumstances::encoder_offset, r);
      // Beyond, it is a homing offset, unless the plant has one already.
      if (joint_.find_effect("homing_offset") == nullptr) close(constant);
      out_.push_back(std::move(constant));
      out_.push_back(recorded("encoder", "ramp", 1.0, s_.quantum, Reaches::kPosition,
                              &JointCircumstances::encoder_ramp, r));
    }
  }

  /// How late the joint is seen. Where the plant states no delay, it is the recorder's; beyond what
  /// recorders may be late by, it is the joint's.
  void delay() {
    if (joint_.find_effect("delay") != nullptr)
      of_plant("delay", "delay", Reaches::kCable);
    else
      out_.push_back(recorded("delay", "delay", kDelayScale_s, kDelayS / kDelayScale_s,
                              Reaches::kCable, &JointCircumstances::truth_lateness_s));
  }

  void law() {
    const bool stated = physics::stated_tolerance(joint_, "controller_gain", "").has_value();
    Parameter gain =
        ratio("controller_gain", stated ? deviation("controller_gain", "") : kLawDeviation,
              Reaches::kLaw);
    gain.set = relative([](auto& joint) -> auto& { return joint.controller->kp_n_m_per_rad; });
    out_.push_back(std::move(gain));
    Parameter rate = linear("controller_gain", "rate_ratio", 1.0, kLawRateDeviation, Reaches::kLaw);
    rate.set = relative([](auto& joint) -> auto& { return joint.controller->kd_n_m_s_per_rad; });
    out_.push_back(std::move(rate));
    const auto seen = [&](const char* name, double mean, double deviation,
                          double LawCircumstances::*part) {
      Parameter p = linear("controller_gain", name, 1.0, deviation, Reaches::kLaw);
      p.mean = p.x = mean;
      p.in_plant = false;
      p.set = [joint = s_.joint, part](State& state, double value) {
        state.laws[joint].*part = value;
      };
      out_.push_back(std::move(p));
    };
    seen("desired_rate", s_.desired_rate, kDesiredRateDeviation, &LawCircumstances::desired_rate);
    seen("age", 0.0, kDelayS, &LawCircumstances::age_s);
  }

  /// Which way a cable runs that other joints move.
  void link_share() {
    if (joint_.coupling_through || !physics::coupled(plant_, s_.joint)) return;
    Parameter p = recorded("coupling", "link_share", 1.0, kLinkShareDeviation, Reaches::kRouting,
                           &JointCircumstances::link_share);
    p.mean = p.x = 0.5;
    p.low = 0.0;
    p.high = 1.0;
    p.step = 0.3;
    out_.push_back(std::move(p));
  }

 private:
  /// Of the cable, when the controller takes the stop for reached: the joint is then as far from
  /// where the motor has it.
  [[nodiscard]] double stretch_at_stop() const {
    if (!joint_.homing) return 0.0;
    const double stiffness = joint_.parameter("compliance", "stiffness");
    const double counts_per_n_m = std::abs(joint_.drive.dac_counts_per_n_m);
    if (stiffness <= 0.0 || counts_per_n_m <= 0.0) return kHomedQuanta * s_.quantum;
    const double capstan_n_m = joint_.homing->dac_threshold_counts / counts_per_n_m;
    return capstan_n_m * joint_.reduction / joint_.gearbox_ratio / stiffness;
  }

  [[nodiscard]] double deviation(const std::string& effect, const std::string& parameter) const {
    return kDeviationPerTolerance * tolerance_of(joint_, effect, parameter);
  }

  /// Writes a relative change of a number of the joint, from the plant's.
  template <typename Number>
  [[nodiscard]] Setter relative(Number number) const {
    return [number, joint = s_.joint, given = number(joint_)](State& state, double ratio) {
      number(state.plant.joints[joint]) = (1.0 + ratio) * given;
    };
  }

  /// Down to nothing.
  [[nodiscard]] Parameter positive(const std::string& effect, const std::string& name, double value,
                                   double deviation, Reaches reaches) const {
    Parameter p = linear(effect, name, value, deviation, reaches);
    p.nominal = value;
    p.low = kLeastRatio;
    return p;
  }

  /// A relative change of what is positive.
  [[nodiscard]] Parameter ratio(const std::string& effect, double deviation,
                                Reaches reaches) const {
    Parameter p = positive(effect, "ratio", 1.0, deviation, reaches);
    p.nominal = 0.0;
    return p;
  }

  [[nodiscard]] Parameter linear(const std::string& effect, const std::string& name, double scale,
                                 double deviation, Reaches reaches) const {
    Parameter p = parameter_of(s_, effect, name, reaches);
    p.scale = scale;
    p.deviation = deviation;
    p.step = 0.5 * deviation;
    return p;
  }

  /// What recordings have, or that one, and no plant.
  template <typename Member>
  [[nodiscard]] Parameter recorded(const std::string& effect, const std::string& name, double scale,
                                   double deviation, Reaches reaches, Member member,
                                   std::optional<std::size_t> recording = {}) const {
    Parameter p = linear(effect, name, scale, deviation, reaches);
    p.in_plant = false;
    p.recording = recording;
    p.set = in_circumstances(s_.joint, recording, member);
    return p;
  }

  /// A number of the simulation's form that the plant has.
  void form(const std::string& effect, const std::string& parameter, double deviation,
            Reaches reaches) {
    const double value = joint_.parameter(effect, parameter);
    if (value <= 0.0) return;
    Parameter p = positive(effect, parameter, value, deviation, reaches);
    p.said = false;
    out_.push_back(std::move(p));
  }

  void either_sign(const std::string& effect, const std::string& parameter, double scale,
                   double deviation, Reaches reaches) {
    Parameter p = linear(effect, parameter, scale, deviation, reaches);
    p.nominal = joint_.parameter(effect, parameter);
    out_.push_back(std::move(p));
  }

  /// Of either sign; nothing where the plant has none.
  void signed_number(const std::string& effect, const std::string& parameter, Reaches reaches) {
    const double value = joint_.parameter(effect, parameter);
    if (value == 0.0) return;
    either_sign(effect, parameter, std::abs(value), deviation(effect, parameter), reaches);
  }

  /// Rows that pass a turn at once hold it to no more than its form.
  void presliding() {
    const double value = joint_.parameter("presliding", "displacement");
    if (value <= 0.0) return;
    Parameter p = positive("presliding", "displacement", value,
                           std::hypot(deviation("presliding", "displacement"), kPreslidingForm),
                           Reaches::kDrive);
    p.said = false;
    out_.push_back(std::move(p));
  }

  void unstated_presliding() {
    const double value =
        s_.prismatic ? physics::kUnstatedPresliding_m : physics::kUnstatedPresliding_rad;
    Parameter p =
        positive("presliding", "displacement", value, kUnstatedPreslidingForm, Reaches::kDrive);
    p.said = false;
    out_.push_back(std::move(p));
  }

  const physics::Plant& plant_;
  const physics::Joint& joint_;
  const Scales& s_;
  std::vector<Parameter>& out_;
};

/// Of the plant's number: how far off one may be that is beyond its tolerance; and one of its form.
constexpr double kOpened = 3.0;
constexpr double kOpenedForm = 100.0;

/// A number whose prior may open.
struct Opening {
  const char* effect;
  const char* parameter;
  bool wrong_number;  ///< else it is physics that the plant lacks: a delay, a payload's weight
};

constexpr Opening kOpenings[] = {
    {"delay", "delay", false},
    {"compliance", "compliance", true},
    {"joint_friction", "level", true},
    {"gravity", "ratio", true},
    {"centre_of_mass", "axial", true},
    {"centre_of_mass", "radial", true},
    {"centre_of_mass", "tangential", true},
    {"torque_constant", "ratio", false},
    {"coulomb_friction", "level", true},
    {"viscous_friction", "damping", true},
    {"stribeck_friction", "extra", true},
    {"load_dependent_friction", "load_share", true},
    {"backlash", "half_width", true},
    {"hysteresis", "stiffness", true},
    {"creep", "compliance", true},
    {"gain_error", "ratio", true},
    {"eccentricity", "amplitude", true},
    {"thermal_drift", "final", true},
    {"torque_ripple", "amplitude", true},
    {"asymmetric_friction", "level_difference", true},
    {"inertia_error", "ratio", true},
    {"controller_gain", "ratio", false},
    {"presliding", "displacement", false},
    {"effort_offset", "offset", false},
};

Parameter opened(const Parameter& number) {
  Parameter p = number;
  p.deviation = number.said ? kOpened : kOpenedForm;
  if (!p.in_plant) {  // what recorders cannot be late by is a delay of the joint
    p.in_plant = true;
    p.low = 0.0;
    p.set = in_plant(p.joint, p.effect, p.name);
  }
  return p;
}

}  // namespace

void close(Parameter& number) {
  const double reach = kWrongBy * number.deviation;
  number.low = std::max(number.low, number.mean - reach);
  number.high = std::min(number.high, number.mean + reach);
}

void add_numbers(const physics::Plant& plant, const Scales& scales, std::size_t recordings,
                 std::vector<Parameter>& out) {
  if (!scales.effort && !scales.truth) return;
  Numbers numbers(plant, scales, out);
  numbers.cable();
  numbers.mass();
  if (scales.effort) numbers.drive();
  if (scales.truth) numbers.encoder(recordings);
  if (scales.law) numbers.law();
  numbers.link_share();
}

void add_wrong_numbers(const physics::Plant& plant, const Scales& s,
                       const std::vector<Parameter>& numbers, std::vector<Candidate>& candidates) {
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    const Parameter& number = numbers[n];
    if (number.joint != s.joint) continue;
    for (const Opening& opening : kOpenings) {
      if (number.effect != opening.effect || number.name != opening.parameter) continue;
      Candidate c;
      c.id = number.effect;
      c.joint = s.joint;
      c.kind = CandidateKind::kNumber;
      c.opens = n;
      c.opened = opened(number);
      const bool stated = plant.joints[s.joint].find_effect(number.effect) != nullptr;
      c.wrong_number = opening.wrong_number || stated;
      candidates.push_back(std::move(c));
    }
  }
}

}  // namespace ravencal::diagnose
