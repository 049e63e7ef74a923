// SPDX-License-Identifier: Apache-2.0
#include <initializer_list>
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
    if (lacks("homing_offset")) {
      either("homing_offset", "offset", 1e-3 * position, Reaches::kCable);
      out_.back().constant = true;
    }
    if (lacks("gain_error")) either("gain_error", "ratio", 4e-3, Reaches::kCable);
    couplings();
    if (joint_.parameter("compliance", "stiffness") <= 0.0 && can_stretch()) {
      Candidate c = begin("compliance");
      c.sizes = {
          size("compliance", 2e-3 * position / s_.load, Reaches::kCable, as_compliance(s_.joint))};
      c.sizes[0].unit = unit_of("creep", "compliance", s_.prismatic);
      out_.push_back(std::move(c));
    }
    stretch_by_loads();
    if (lacks("backlash")) positive("backlash", "half_width", 8e-4 * position, Reaches::kCable);
    if (lacks("hysteresis") && !can_stretch()) loop("hysteresis", "half_loop", "");
    if (s_.tracking && lacks("coulomb_friction")) loop("coulomb_friction", "lag", "");
    if (lacks("hysteresis") && can_stretch()) {
      Candidate c = begin("hysteresis");
      c.sizes = {size("stiffness", 40.0 * s_.load / position, Reaches::kCable)};
      c.sizes[0].high = 40.0;
      add(std::move(c), form("yield", kFormDeviation, Reaches::kCable),
          {2e-3 * position, 5e-3 * position, 12e-3 * position});
    }
    if (lacks("creep") && can_stretch()) creep();
    if (lacks("eccentricity")) wave("eccentricity", 5e-4 * position, Reaches::kCable, false);
    if (lacks("thermal_drift")) {
      Candidate c = begin("thermal_drift");
      c.sizes = {signed_size("final", 1e-3 * position, Reaches::kCable)};
      // One that is over at once is a constant.
      Parameter time = form("time", kTimeDeviation, Reaches::kCable);
      time.low = -2.0 * kTimeDeviation;
      add(std::move(c), std::move(time), {0.2 * s_.length_s, 0.5 * s_.length_s, s_.length_s});
    }
    for (std::size_t r = 0; r < recordings_; ++r) {
      jump("slip", r, [](JointCircumstances& c) -> physics::Jump& { return c.slip; });
      jump("lost_counts", r, [](JointCircumstances& c) -> physics::Jump& { return c.lost_counts; });
    }
  }

  void of_both() {
    // Without a cable that yields, friction behind it is friction before it.
    const bool told_apart = joint_.parameter("compliance", "stiffness") > 0.0 ||
                            joint_.parameter("backlash", "half_width") > 0.0;
    if (lacks("joint_friction") && told_apart) {
      Candidate c = begin("joint_friction");
      c.sizes = {size("level", 0.2 * s_.load, Reaches::kCable)};
      add(std::move(c), form("presliding", kFormDeviation, Reaches::kCable), {1e-4 * s_.position});
    }
  }

  void of_effort() {
    if (lacks("coulomb_friction")) positive("coulomb_friction", "level", 0.4 * s_.load);
    if (lacks("viscous_friction"))
      positive("viscous_friction", "damping", 1.5 * s_.load / s_.position);
    if (lacks("stribeck_friction")) {
      Candidate c = begin("stribeck_friction");
      c.sizes = {size("extra", 0.2 * s_.load, Reaches::kDrive)};
      add(std::move(c), form("velocity", kSpeedDeviation, Reaches::kDrive),
          {8e-3 * s_.position, 16e-3 * s_.position, 30e-3 * s_.position});
    }
    if (lacks("load_dependent_friction") && s_.weight_load > 0.0)
      positive("load_dependent_friction", "load_share", 0.08);
    if (lacks("asymmetric_friction"))
      either("asymmetric_friction", "level_difference", 0.2 * s_.load, Reaches::kDrive);
    if (s_.unknown_weight && !s_.prismatic && lacks("gravity")) gravity();
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

  [[nodiscard]] Candidate begin(const std::string& id) const {
    Candidate c;
    c.id = id;
    c.joint = s_.joint;
    current_ = id;
    return c;
  }

  [[nodiscard]] Parameter signed_size(const std::string& name, double start, Reaches reaches,
                                      Setter set = {}, const std::string& from = "") const {
    Parameter p;
    p.effect = current_;
    p.name = name;
    p.unit = unit_of(current_, name, s_.prismatic);
    p.joint = s_.joint;
    p.reaches = reaches;
    p.scale = start;
    p.deviation = kUnknownSize;
    p.step = 1.0;
    p.set = set ? std::move(set) : in_plant(s_.joint, current_, name, from);
    return p;
  }

  [[nodiscard]] Parameter size(const std::string& name, double start, Reaches reaches,
                               Setter set = {}) const {
    Parameter p = signed_size(name, start, reaches, std::move(set));
    p.low = kLeastOfStart;
    return p;
  }

  /// A positive form; one without a nominal value takes its start for it.
  [[nodiscard]] Parameter form(const std::string& name, double deviation, Reaches reaches,
                               Setter set = {}) const {
    Parameter p;
    p.effect = current_;
    p.name = name;
    p.unit = unit_of(current_, name, s_.prismatic);
    p.joint = s_.joint;
    p.reaches = reaches;
    p.logarithmic = true;
    p.deviation = deviation;
    p.step = 0.03;
    p.set = set ? std::move(set) : in_plant(s_.joint, current_, name);
    return p;
  }

  void either(const std::string& id, const std::string& name, double start, Reaches reaches) {
    Candidate c = begin(id);
    c.sizes = {signed_size(name, start, reaches)};
    out_.push_back(std::move(c));
  }

  void positive(const std::string& id, const std::string& name, double start,
                Reaches reaches = Reaches::kDrive) {
    Candidate c = begin(id);
    c.sizes = {size(name, start, reaches)};
    out_.push_back(std::move(c));
  }

  /// With one form, tried from each of these values.
  void add(Candidate c, Parameter form, std::initializer_list<double> starts) {
    c.forms = {std::move(form)};
    for (const double start : starts) c.starts.push_back({start});
    out_.push_back(std::move(c));
  }

  void couplings() {
    for (std::size_t k = 0; k < plant_.joints.size(); ++k) {
      if (k == s_.joint || (k > s_.joint && chain_is_known())) continue;
      const std::string& from = plant_.joints[k].name;
      Candidate c = begin("coupling");
      c.from = from;
      const bool stated = plant_number(plant_, s_.joint, "coupling", "error", from) != 0.0;
      if (stated) continue;
      c.sizes = {signed_size("error", 4e-3 * s_.range / all_[k].range, Reaches::kCable, {}, from)};
      out_.push_back(std::move(c));
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
    Candidate c = begin("compliance");
    for (const LoadScale& load : s_.loads) {
      if (plant_number(plant_, s_.joint, "compliance", "stretch_per_load", load.name) != 0.0)
        continue;
      Parameter p = signed_size("stretch_per_load", 1e-3 * s_.position / load.largest,
                                Reaches::kCable, {}, load.name);
      p.name = "compliance_to_" + load.name;
      p.unit = (s_.prismatic ? "m_per_" : "rad_per_") + load.unit;
      c.sizes.push_back(std::move(p));
      c.from = load.name;
    }
    if (c.sizes.size() == 1)
      c.sizes[0].name = "stretch_per_load";
    else
      c.from.clear();
    if (!c.sizes.empty()) out_.push_back(std::move(c));
  }

  /// A loop over the position of the joint, or of another one whose cable drags it, where no load
  /// is known that would stretch the cable.
  void loop(const std::string& id, const std::string& half_height, const std::string& from) {
    Candidate c = begin(id);
    c.from = from;
    const double range = from.empty() ? s_.range : all_[*plant_.joint_index(from)].range;
    c.sizes = {signed_size(half_height, 1e-3 * s_.position, Reaches::kCable, {}, from)};
    if (from.empty()) c.sizes[0].low = kLeastOfStart;
    Parameter width =
        form("width", kFormDeviation, Reaches::kCable, in_plant(s_.joint, id, "width", from));
    width.nominal = kWidestLoop * range;
    width.high = 0.0;
    add(std::move(c), std::move(width), {0.003 * range, 0.02 * range, 0.1 * range, 0.4 * range});
  }

  void creep() {
    Candidate c = begin("creep");
    c.sizes = {size("compliance", 8e-4 * s_.position / s_.load, Reaches::kCable)};
    Parameter start = form("start", kCreepStartDeviation, Reaches::kCable,
                           in_circumstances(s_.joint, {}, [](JointCircumstances& j) -> double& {
                             return j.creep_start;
                           }));
    start.logarithmic = false;
    start.said = false;
    c.forms = {form("time", kTimeDeviation, Reaches::kCable), start};
    for (const double time_s : {2.5, 7.0, 20.0})
      for (const double share : {0.0, 1.0}) c.starts.push_back({time_s, share});
    out_.push_back(std::move(c));
  }

  /// A sine and a cosine over the position of the drive. The order is searched for, not fitted.
  void wave(const std::string& id, double start, Reaches reaches, bool of_motor) {
    Candidate c = begin(id);
    c.sizes = {signed_size("sine", start, reaches, as_sine(s_.joint, id)),
               signed_size("cosine", start, reaches, as_cosine(s_.joint, id))};
    for (Parameter& p : c.sizes) p.unit = unit_of(id, "amplitude", s_.prismatic);
    Parameter order = form("order", kFormDeviation, reaches);
    order.held = true;
    c.forms = {order};
    const auto passed = [&](double turned) {
      if (turned * s_.range >= kFewestPeriods * 2.0 * std::numbers::pi)
        c.starts.push_back({turned});
    };
    for (const double harmonic : kHarmonics)
      passed(harmonic * joint_.reduction / joint_.gearbox_ratio);
    if (of_motor) passed(joint_.reduction);
    if (!c.starts.empty()) out_.push_back(std::move(c));
  }

  /// A weight that the plant does not know: what holds it follows the posture.
  void gravity() {
    Candidate c = begin("gravity");
    c.sizes = {
        signed_size("sine", 0.2 * s_.load, Reaches::kDrive, as_sine(s_.joint, "gravity")),
        signed_size("cosine", 0.2 * s_.load, Reaches::kDrive, as_cosine(s_.joint, "gravity"))};
    for (Parameter& p : c.sizes) p.unit = unit_of("gravity", "amplitude", s_.prismatic);
    out_.push_back(std::move(c));
  }

  /// A limit holds or it does not; where it lies is tried between the usual effort and the
  /// greatest.
  void saturation() {
    Candidate c = begin("saturation");
    Parameter holds = size(
        "holds", 1.0, Reaches::kLimit,
        [joint = s_.joint](State& state, double value) { state.laws[joint].saturated = value; });
    holds.low = kLeastHeld;
    holds.high = 1.0;
    holds.step = 0.5;
    holds.said = false;
    holds.in_plant = false;
    c.sizes = {holds};
    // It stays near where the screen found it: rows below a lower one would be taken as asked.
    Parameter limit = form("limit", kLimitDeviation, Reaches::kLimit);
    limit.low = -2.0 * kLimitDeviation;
    limit.high = 2.0 * kLimitDeviation;
    c.forms = {limit};
    for (const double share : kLimits) c.starts.push_back({share * s_.greatest_effort});
    out_.push_back(std::move(c));
  }

  /// Its moment is searched for: the screen sets the starts.
  template <typename Member>
  void jump(const std::string& id, std::size_t recording, Member member) {
    Candidate c = begin(id);
    c.kind = CandidateKind::kJump;
    c.sizes = {signed_size("size", 1e-3 * s_.position, Reaches::kCable)};
    c.sizes[0].unit = s_.prismatic ? "m" : "rad";
    c.sizes[0].recording = recording;
    c.sizes[0].set = [joint = s_.joint, recording, member](State& state, double value) {
      member(state.circumstances[recording][joint]).size = value;
    };
    Parameter moment = form("time", kTimeDeviation, Reaches::kCable);
    moment.unit = "s";
    moment.logarithmic = false;
    moment.held = true;
    moment.recording = recording;
    moment.set = [joint = s_.joint, recording, member](State& state, double value) {
      member(state.circumstances[recording][joint]).t_s = value;
    };
    c.forms = {moment};
    out_.push_back(std::move(c));
  }

  const physics::Plant& plant_;
  const physics::Joint& joint_;
  const std::vector<Scales>& all_;
  const Scales& s_;
  std::size_t recordings_;
  std::vector<Candidate>& out_;
  mutable std::string current_;  ///< id of the candidate that is being made
};

}  // namespace

void add_effects(const physics::Plant& plant, const std::vector<Scales>& scales, std::size_t joint,
                 std::size_t recordings, std::vector<Candidate>& candidates) {
  const Scales& s = scales[joint];
  if (!s.effort && !s.truth) return;
  Effects effects(plant, scales, joint, recordings, candidates);
  if (s.truth) effects.of_position();
  effects.of_both();
  if (s.effort) effects.of_effort();
  if (s.law) effects.of_law();
}

void add_payload(const physics::Plant& plant, std::vector<Candidate>& candidates) {
  Candidate c;
  c.id = "payload";
  c.joint = plant.joints.size() - 1;
  Parameter mass;
  mass.effect = c.id;
  mass.name = "mass";
  mass.unit = "kg";
  mass.joint = c.joint;
  mass.reaches = Reaches::kEverything;
  mass.scale = 0.1;
  mass.deviation = kUnknownSize;
  mass.low = kLeastOfStart;
  mass.step = 1.0;
  mass.set = of_payload(plant.payload.mass_kg);
  c.sizes = {mass};
  candidates.push_back(std::move(c));
}

}  // namespace ravencal::diagnose
