// SPDX-License-Identifier: Apache-2.0
#include <numbers>
#include <utility>

#include "diagnose/vocabulary/candidates.hpp"
#include "diagnose/vocabulary/setters.hpp"

namespace ravencal::diagnose {
namespace {

using physics::JointCircumstances;

/// Of its start: below, an effect that can only be positive is absent.
constexpr double kLeastOfStart = 0.002;
/// Harmonics of a pulley that are tried.
constexpr double kHarmonics[] = {1.0, 2.0, 3.0};
/// Periods that a motion passes at least: less of a sine is a slope or a constant.
constexpr double kFewestPeriods = 1.0;
/// Shares of the greatest recorded effort at which a limit is tried, and the least share of it that
/// counts as one.
constexpr double kLimits[] = {0.03, 0.06, 0.12, 0.25, 0.4, 0.55, 0.7, 0.85, 0.95};
constexpr double kLeastHeld = 0.5;
constexpr double kLimitDeviation = 0.15;
/// Share of its range over which a motion passes from one side of a loop to the other: one that
/// never closes is a slope whose constant depends on where the recording began.
constexpr double kWidestLoop = 0.5;
/// Deviations of the logarithm of forms: widths, times, speeds.
constexpr double kFormDeviation = 1.0;
constexpr double kTimeDeviation = 0.7;
constexpr double kSpeedDeviation = 0.5;
constexpr double kCreepStartDeviation = 1.0;
/// A scale further from that of the plant is another transmission.
constexpr double kMostGainError = 0.3;

class Effects {
 public:
  Effects(const physics::Plant& plant, const std::vector<Scales>& scales, std::size_t joint,
          std::size_t recordings, std::vector<Candidate>& out)
      : plant_(plant),
        joint_(plant.joints[joint]),
        all_(scales),
        s_(scales[joint]),
        recordings_(recordings),
        out_(out) {}

  void of_position() {
    const double position = s_.position;
    if (lacks("homing_offset"))
      add({signed_size("homing_offset", "offset", 1e-3 * position, Reaches::kCable)}).constant =
          true;
    if (lacks("gain_error")) gain_error();
    couplings();
    if (joint_.parameter("compliance", "stiffness") <= 0.0 && can_stretch()) {
      Parameter p = size("compliance", "compliance", 2e-3 * position / s_.load, Reaches::kCable);
      p.unit = unit_of("creep", "compliance", s_.prismatic);
      p.set = as_compliance(s_.joint);
      add_yielding(std::move(p));
    }
    stretch_by_loads();
    if (lacks("backlash"))
      add_yielding(size("backlash", "half_width", 8e-4 * position, Reaches::kCable));
    if (lacks("hysteresis") && !can_stretch()) loop("hysteresis", "half_loop", "");
    if (s_.tracking && lacks("coulomb_friction")) loop("coulomb_friction", "lag", "");
    if (lacks("hysteresis") && can_stretch()) {
      Parameter p = size("hysteresis", "stiffness", 40.0 * s_.load / position, Reaches::kCable);
      p.high = 40.0;
      add({p}, form("hysteresis", "yield", kFormDeviation, Reaches::kCable),
          {2e-3 * position, 5e-3 * position, 12e-3 * position});
    }
    if (lacks("creep") && can_stretch()) creep();
    if (lacks("eccentricity")) wave("eccentricity", 5e-4 * position, Reaches::kCable, false);
    if (lacks("thermal_drift")) {
      // One that is over at once is a constant.
      Parameter time = form("thermal_drift", "time", kTimeDeviation, Reaches::kCable);
      time.low = -2.0 * kTimeDeviation;
      add({signed_size("thermal_drift", "final", 1e-3 * position, Reaches::kCable)},
          std::move(time), {0.2 * s_.length_s, 0.5 * s_.length_s, s_.length_s});
    }
    for (std::size_t r = 0; r < recordings_; ++r) {
      jump("slip", r, &JointCircumstances::slip);
      jump("lost_counts", r, &JointCircumstances::lost_counts);
    }
  }

  void of_both() {
    if (!lacks("joint_friction")) return;
    // Where nothing yields, friction behind it is friction before it.
    const bool yields = joint_.parameter("compliance", "stiffness") > 0.0 ||
                        joint_.parameter("backlash", "half_width") > 0.0;
    if (!yields && yielding_.empty()) return;
    add({size("joint_friction", "level", 0.2 * s_.load, Reaches::kCable)},
        form("joint_friction", "presliding", kFormDeviation, Reaches::kCable), {1e-4 * s_.position})
        .behind = yields ? std::vector<std::size_t>{} : yielding_;
  }

  void of_effort() {
    const auto drive = [&](const std::string& id, const std::string& name, double start) {
      if (lacks(id)) add({size(id, name, start, Reaches::kDrive)});
    };
    drive("coulomb_friction", "level", 0.4 * s_.load);
    if (s_.moves) drive("viscous_friction", "damping", 1.5 * s_.load / s_.position);
    if (s_.moves && lacks("stribeck_friction"))
      add({size("stribeck_friction", "extra", 0.2 * s_.load, Reaches::kDrive)},
          form("stribeck_friction", "velocity", kSpeedDeviation, Reaches::kDrive),
          {8e-3 * s_.position, 16e-3 * s_.position, 30e-3 * s_.position});
    if (s_.weight_load > 0.0) drive("load_dependent_friction", "load_share", 0.08);
    if (lacks("asymmetric_friction"))
      add({signed_size("asymmetric_friction", "level_difference", 0.2 * s_.load, Reaches::kDrive)});
    // A weight that the plant does not know: what holds it follows the posture.
    if (s_.unknown_weight && !s_.prismatic && lacks("gravity"))
      add(sine_and_cosine("gravity", 0.2 * s_.load, Reaches::kDrive));
    if (lacks("torque_ripple")) wave("torque_ripple", 0.1 * s_.load, Reaches::kDrive, true);
  }

  void of_law() {
    if (lacks("saturation")) saturation();
  }

 private:
  [[nodiscard]] bool lacks(const std::string& id) const { return !joint_.find_effect(id); }
  /// A cable that no load changes has no stretch to show.
  [[nodiscard]] bool can_stretch() const {
    return s_.weight_load > 0.0 || joint_.parameter("joint_friction", "level") > 0.0;
  }

  [[nodiscard]] Parameter signed_size(const std::string& id, const std::string& name, double start,
                                      Reaches reaches, const std::string& from = "") const {
    Parameter p = parameter_of(s_, id, name, reaches, from);
    p.scale = start;
    p.deviation = kUnknownSize;
    p.step = 1.0;
    return p;
  }

  [[nodiscard]] Parameter size(const std::string& id, const std::string& name, double start,
                               Reaches reaches) const {
    Parameter p = signed_size(id, name, start, reaches);
    p.low = kLeastOfStart;
    return p;
  }

  /// A positive form; one without a nominal value takes its start for it.
  [[nodiscard]] Parameter form(const std::string& id, const std::string& name, double deviation,
                               Reaches reaches, const std::string& from = "") const {
    Parameter p = parameter_of(s_, id, name, reaches, from);
    p.logarithmic = true;
    p.deviation = deviation;
    p.step = 0.03;
    return p;
  }

  /// What lets the joint move while the drive stands.
  void add_yielding(Parameter effect_size) {
    yielding_.push_back(out_.size());
    add({std::move(effect_size)});
  }

  Candidate& add(std::vector<Parameter> sizes) {
    Candidate& c = out_.emplace_back();
    c.id = sizes.front().effect;
    c.joint = s_.joint;
    c.sizes = std::move(sizes);
    return c;
  }

  /// With one form, tried from each of these values.
  Candidate& add(std::vector<Parameter> sizes, Parameter form, const std::vector<double>& starts) {
    Candidate& c = add(std::move(sizes));
    c.forms = {std::move(form)};
    for (const double start : starts) c.starts.push_back({start});
    return c;
  }

  void gain_error() {
    Parameter ratio = signed_size("gain_error", "ratio", 4e-3, Reaches::kCable);
    ratio.high = kMostGainError / ratio.scale;
    ratio.low = -ratio.high;
    add({ratio});
  }

  void couplings() {
    for (std::size_t k = 0; k < plant_.joints.size(); ++k) {
      if (k == s_.joint || (k > s_.joint && chain_is_known())) continue;
      const std::string& from = plant_.joints[k].name;
      if (plant_number(plant_, s_.joint, "coupling", "error", from) != 0.0) continue;
      const double start = 4e-3 * s_.range / all_[k].range;
      add({signed_size("coupling", "error", start, Reaches::kCable, from)}).from = from;
      if (lacks("hysteresis") && !can_stretch()) loop("hysteresis", "half_loop", from);
    }
  }

  /// A plant that couples joints says in which order cables run over them: over those before.
  [[nodiscard]] bool chain_is_known() const {
    for (std::size_t j = 0; j < plant_.joints.size(); ++j)
      if (physics::coupled(plant_, j)) return true;
    return false;
  }

  /// What recorded loads add to the cable's stretch beside the load that the plant predicts. Loads
  /// of one arm act together: each alone stands in for the others.
  void stretch_by_loads() {
    std::vector<Parameter> sizes;
    std::string from;
    for (const LoadScale& load : s_.loads) {
      if (plant_number(plant_, s_.joint, "compliance", "stretch_per_load", load.name) != 0.0)
        continue;
      Parameter p = signed_size("compliance", "stretch_per_load", 1e-3 * s_.position / load.largest,
                                Reaches::kCable, load.name);
      p.name = "compliance_to_" + load.name;
      p.unit = (s_.prismatic ? "m_per_" : "rad_per_") + load.unit;
      sizes.push_back(std::move(p));
      from = load.name;
    }
    if (sizes.size() == 1) sizes[0].name = "stretch_per_load";
    if (sizes.size() > 1) from.clear();
    if (!sizes.empty()) add(std::move(sizes)).from = from;
  }

  /// A loop over the position of the joint, or of another one whose cable drags it, where no load
  /// is known that would stretch the cable.
  void loop(const std::string& id, const std::string& half_height, const std::string& from) {
    const double range = from.empty() ? s_.range : all_[*plant_.joint_index(from)].range;
    Parameter half = signed_size(id, half_height, 1e-3 * s_.position, Reaches::kCable, from);
    if (from.empty()) half.low = kLeastOfStart;
    Parameter width = form(id, "width", kFormDeviation, Reaches::kCable, from);
    width.nominal = kWidestLoop * range;
    width.high = 0.0;
    add({half}, std::move(width), {0.003 * range, 0.02 * range, 0.1 * range, 0.4 * range}).from =
        from;
  }

  void creep() {
    Parameter start = form("creep", "start", kCreepStartDeviation, Reaches::kCable);
    start.set = in_circumstances(s_.joint, {}, &JointCircumstances::creep_start);
    start.logarithmic = false;
    start.said = false;
    Candidate& c =
        add({size("creep", "compliance", 8e-4 * s_.position / s_.load, Reaches::kCable)});
    c.forms = {form("creep", "time", kTimeDeviation, Reaches::kCable), start};
    c.forms.front().low = -2.0 * kTimeDeviation;  // what is over at once is a compliance
    for (const double time_s : {2.5, 7.0, 20.0})
      for (const double share : {0.0, 1.0}) c.starts.push_back({time_s, share});
  }

  [[nodiscard]] std::vector<Parameter> sine_and_cosine(const std::string& id, double start,
                                                       Reaches reaches) const {
    std::vector<Parameter> sizes = {signed_size(id, "sine", start, reaches),
                                    signed_size(id, "cosine", start, reaches)};
    for (std::size_t part = 0; part < sizes.size(); ++part) {
      sizes[part].unit = unit_of(id, "amplitude", s_.prismatic);
      sizes[part].set = as_wave(s_.joint, id, part);
    }
    return sizes;
  }

  /// A sine and a cosine over the position of the drive. The order is searched for, not fitted.
  void wave(const std::string& id, double start, Reaches reaches, bool of_motor) {
    Parameter order = form(id, "order", kFormDeviation, reaches);
    order.held = true;
    std::vector<double> orders;
    const auto passed = [&](double turned) {
      if (turned * s_.range >= kFewestPeriods * 2.0 * std::numbers::pi) orders.push_back(turned);
    };
    for (const double harmonic : kHarmonics)
      passed(harmonic * joint_.reduction / joint_.gearbox_ratio);
    if (of_motor) passed(joint_.reduction);
    add(sine_and_cosine(id, start, reaches), std::move(order), orders).stated_orders =
        orders.size();
  }

  /// A limit holds or it does not; where it lies is tried between the usual effort and the
  /// greatest.
  void saturation() {
    Parameter holds = size("saturation", "holds", 1.0, Reaches::kLimit);
    holds.set = [joint = s_.joint](State& state, double value) {
      state.laws[joint].saturated = value;
    };
    holds.low = kLeastHeld;
    holds.high = 1.0;
    holds.step = 0.5;
    holds.said = false;
    holds.in_plant = false;
    // It stays near where the screen found it: rows below a lower one would be taken as asked.
    Parameter limit = form("saturation", "limit", kLimitDeviation, Reaches::kLimit);
    limit.low = -2.0 * kLimitDeviation;
    limit.high = 2.0 * kLimitDeviation;
    std::vector<double> limits;
    for (const double share : kLimits) limits.push_back(share * s_.greatest_effort);
    add({holds}, std::move(limit), limits);
  }

  /// Its moment is searched for: the screen sets the starts.
  void jump(const std::string& id, std::size_t recording,
            physics::Jump JointCircumstances::*member) {
    Parameter jumped = signed_size(id, "size", 1e-3 * s_.position, Reaches::kCable);
    jumped.unit = s_.prismatic ? "m" : "rad";
    jumped.recording = recording;
    jumped.set = in_circumstances(s_.joint, recording,
                                  [member](auto& c) -> double& { return (c.*member).size; });
    Parameter moment = form(id, "time", kTimeDeviation, Reaches::kCable);
    moment.unit = "s";
    moment.logarithmic = false;
    moment.held = true;
    moment.recording = recording;
    moment.set = in_circumstances(s_.joint, recording,
                                  [member](auto& c) -> double& { return (c.*member).t_s; });
    add({jumped}, std::move(moment), {}).kind = CandidateKind::kJump;
  }

  const physics::Plant& plant_;
  const physics::Joint& joint_;
  const std::vector<Scales>& all_;
  const Scales& s_;
  std::size_t recordings_;
  std::vector<Candidate>& out_;
  std::vector<std::size_t> yielding_{};  ///< places in out_
};

}  // namespace

void add_effects(const physics::Plant& plant, const std::vector<Scales>& scales, std::size_t joint,
                 std::size_t recordings, std::vector<Candidate>& candidates) {
  const Scales& s = scales[joint];
  if (!s.effort && !s.truth && !s.followed) return;
  Effects effects(plant, scales, joint, recordings, candidates);
  if (s.truth) effects.of_position();
  effects.of_both();
  if (s.effort || s.followed) effects.of_effort();
  if (s.law) effects.of_law();
}

}  // namespace ravencal::diagnose
