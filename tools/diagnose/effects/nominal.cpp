// SPDX-License-Identifier: Apache-2.0
#include "diagnose/effects/nominal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "diagnose/effects/shapes.hpp"
#include "diagnose/series/posture.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Two streams of one recorder are rarely aligned better.
constexpr double kAlignment_s = 0.003;
/// Cosines over a recording that stand for a slow change; faster ones are noise like any other.
constexpr int kSlowCosines = 8;
/// Of a side in [-1, 1] from another one, so that the greatest difference is at its limit.
constexpr double kSideDeviation = 1.6;
/// Starts that are more frequent are poses of a static set.
constexpr Index kMostStarts = 40;
/// Times of a change beyond which its slow cosines hold less than half of its variance.
constexpr double kLongForSlow = 20.0;
/// A plant knows by how much its numbers change to a factor of two.
constexpr double kKnownDeviation = 2.0;

class NominalBuilder {
 public:
  NominalBuilder(const Series& s, const physics::Plant& plant, std::size_t index)
      : s_(s), plant_(plant), index_(index), joint_(plant.joints[index]) {
    nominal_.prediction = VectorXd::Zero(s.rows());
  }

  void linear(const std::string& id, const std::string& parameter, const std::string& unit,
              double value, const VectorXd& column) {
    if (value == 0.0) return;
    nominal_.prediction += value * column;
    nominal_.terms.push_back(
        {id, parameter, unit, value, tolerance_of(joint_, id, parameter), value * column});
  }

  void drive() {
    linear("inertia_error", "inertia", s_.prismatic ? "kg" : "kg_m2", s_.inertia, s_.motion.a);
    load();
    const std::string damping = s_.prismatic ? "N_s_per_m" : "N_m_s_per_rad";
    linear("viscous_friction", "damping", damping, joint_.parameter("viscous_friction", "damping"),
           s_.as_seen(s_.motion.v));
    dry_friction_of_drive();
    // Recorded effort is the needed one over 1 + ratio.
    const double ratio = joint_.parameter("torque_constant", "ratio");
    if (ratio == 0.0) return;
    nominal_.prediction /= 1.0 + ratio;
    for (NominalTerm& term : nominal_.terms) term.column /= 1.0 + ratio;
  }

  /// Effects that the plant describes by their shape alone; nobody says how far they may be off.
  void shapes() { nominal_.prediction += physics::shape_error(joint_, signals_of(s_)); }

  void transmission() {
    linear("gain_error", "ratio", "1", joint_.parameter("gain_error", "ratio"), motor_part());
    // A reading of the truth is stamped late by its transfer. A recorder that pairs the nearest
    // stamps adds nothing on average, one that repeats the latest reading half a period: which it
    // does is not known, nor the alignment of its streams.
    const double latency_s = plant_.logger.truth_latency_s;
    if (latency_s > 0.0) {
      const double pairing_s = 0.25 * plant_.logger.truth_period_s;
      linear("delay", "truth_latency", "s", latency_s + pairing_s, -s_.motion.v);
      nominal_.terms.back().tolerance =
          (0.1 * latency_s + pairing_s + kAlignment_s) / (latency_s + pairing_s);
    } else {
      nominal_.terms.push_back(
          {"delay", "alignment", "s", 0.0, 1.0, -kAlignment_s * s_.motion.v, true});
    }
    for (const physics::Effect& effect : joint_.effects) {
      if (effect.id != "coupling") continue;
      for (const Companion& other : s_.others) {
        if (other.name != effect.from) continue;
        linear("coupling", "error", per(s_.unit, other.unit),
               effect.parameters.find("error")->second, other.value);
        if (!nominal_.terms.empty() && nominal_.terms.back().id == "coupling")
          nominal_.terms.back().from = other.name;
      }
    }
    inherited();
    run_out();
    cable();
    wander();
  }

  Nominal take() {
    for (NominalTerm& term : nominal_.terms) {
      if (term.parameter == "level") term.variation = joint_.parameter(term.id, "variation");
    }
    return std::move(nominal_);
  }

 private:
  /// How friction turns over a reversal and how it falls with speed is a matter of its
  /// microphysics, which no simulation has exactly: bristles from half to six times as long, and
  /// either law of the fall, are all the same friction.
  void dry_friction_of_drive() {
    const double level = joint_.parameter("coulomb_friction", "level");
    const double extra = joint_.parameter("stribeck_friction", "extra");
    if (level <= 0.0) return;
    const auto seen = [&](const DryFriction& f) {
      return VectorXd(level * s_.as_seen(dry_friction(s_, f)));
    };
    const double displacement = s_.friction_displacement();
    const VectorXd dry = seen({displacement});
    linear("coulomb_friction", "level", s_.unit, level, dry / level);
    slow_changes("coulomb_friction", "variation", "1", dry);
    DryFriction whole{displacement};
    VectorXd effort = dry;
    if (extra > 0.0) {
      whole.extra = extra / level;
      whole.velocity = std::max(1e-9, joint_.parameter("stribeck_friction", "velocity"));
      effort = seen(whole);
      linear("stribeck_friction", "extra", s_.unit, extra, (effort - dry) / extra);
      DryFriction steep = whole;
      steep.fall_off = FallOff::kSteep;
      add_form("stribeck_friction", "velocity", whole.velocity, seen(steep) - effort);
    }
    for (const double factor : {0.5, 2.5, 6.0}) {
      DryFriction longer = whole;
      longer.displacement *= factor;
      add_form("presliding", "displacement", longer.displacement, seen(longer) - effort);
    }
  }

  void add_form(const std::string& id, const std::string& parameter, double value,
                VectorXd column) {
    nominal_.terms.push_back(
        {id, parameter, position_unit(s_), value, 1.0, std::move(column), true});
  }

  /// What the cable passes back to the drive: weight and friction behind it.
  void load() {
    const CableNumbers& c = s_.cable;
    if (s_.others_friction.size() > 0) nominal_.prediction += s_.as_seen(s_.others_friction);
    if (s_.weight.size() == 0 && c.friction_level <= 0.0) return;
    const VectorXd tension = s_.as_seen(cable_tension(s_, c));
    nominal_.prediction += tension;
    const auto add = [&](const std::string& id, const std::string& parameter,
                         const std::string& unit, double value, bool form_only, auto&& change) {
      if (value == 0.0) return;
      constexpr double kStep = 0.05;
      CableNumbers changed = c;
      change(changed, 1.0 + kStep);
      nominal_.terms.push_back(
          {id, parameter, unit, value, form_only ? 1.0 : tolerance_of(joint_, id, parameter),
           (s_.as_seen(cable_tension(s_, changed)) - tension) / kStep, form_only});
    };
    if (s_.weight.size() > 0)
      add("gravity", "weight_scale", "1", 1.0, false,
          [](CableNumbers& n, double f) { n.weight_scale *= f; });
    add("joint_friction", "level", s_.unit, c.friction_level, false,
        [](CableNumbers& n, double f) { n.friction_level *= f; });
    if (c.friction_level <= 0.0) return;
    slow_changes("joint_friction", "variation", "1", VectorXd(nominal_.terms.back().column));
    // How friction behind the cable builds up is the cable's and the friction's microphysics.
    add("joint_friction", "presliding", position_unit(s_), c.friction_presliding, true,
        [](CableNumbers& n, double f) { n.friction_presliding *= f * f * f; });
    add("compliance", "stiffness", "1", c.compliance, true,
        [](CableNumbers& n, double f) { n.compliance *= f; });
  }

  /// Run-out turns with the drive, wherever homing has put the zero from which the robot counts:
  /// the encoder says where, to a fraction of a turn.
  void run_out() {
    constexpr double kPhase_rad = 0.3;
    const double amplitude = joint_.parameter("eccentricity", "amplitude");
    const VectorXd angle = joint_.parameter("eccentricity", "order") * encoder_position() +
                           VectorXd::Constant(s_.rows(), joint_.parameter("eccentricity", "phase"));
    linear("eccentricity", "amplitude", s_.unit, amplitude, angle.array().sin().matrix());
    if (amplitude == 0.0) return;
    nominal_.terms.push_back({"eccentricity", "phase", "rad", 1.0, kPhase_rad,
                              amplitude * angle.array().cos().matrix(), true});
  }

  /// Own position as the encoder corrects it, in what is linear in the believed ones.
  [[nodiscard]] VectorXd encoder_position() const {
    std::vector<VectorXd> believed = {s_.motion.q}, truth = {s_.motion.q + s_.y};
    for (Index i = 0; i < s_.rows(); ++i) {
      if (s_.valid[static_cast<std::size_t>(i)] == 0)
        truth.front()[i] = std::numeric_limits<double>::quiet_NaN();
    }
    for (const Companion& other : s_.others) {
      believed.push_back(other.value);
      truth.emplace_back();
    }
    return posture_of(believed, truth, s_.recording).front();
  }

  /// Half of what other joints may pass on is expected, none and all of it are as likely.
  void inherited() {
    for (const Inherited& part : s_.inherited) {
      for (const VectorXd* column : {&part.stretch, &part.rest}) {
        if (column->isZero(0.0)) continue;
        nominal_.prediction += 0.5 * *column;
        nominal_.terms.push_back(
            {"coupling", "inherited_share", "1", 0.5, 1.0, 0.5 * *column, true, part.from});
      }
    }
  }

  void cable() {
    const CableNumbers& c = s_.cable;
    if (c.rigid()) return;
    const VectorXd stretch = cable_stretch(s_, c);
    nominal_.prediction -= stretch;
    const std::string stiffness_unit = per(effort_unit(s_), position_unit(s_));
    uncertain("compliance", "stiffness", stiffness_unit,
              c.compliance > 0.0 ? 1.0 / c.compliance : 0.0, stretch,
              [](CableNumbers& n, double f) { n.compliance /= f; });
    if (s_.weight.size() > 0) {
      uncertain("gravity", "weight_scale", "1", 1.0, stretch,
                [](CableNumbers& n, double f) { n.weight_scale *= f; });
      if (s_.weight_deviation) {
        nominal_.terms.back().tolerance = *s_.weight_deviation;
        nominal_.terms.back().form_only = true;
      }
    }
    found_load(stretch);
    constant_load();
    uncertain("joint_friction", "level", effort_unit(s_), c.friction_level, stretch,
              [](CableNumbers& n, double f) { n.friction_level *= f; });
    uncertain("hysteresis", "stiffness", stiffness_unit, c.strand_stiffness, stretch,
              [](CableNumbers& n, double f) { n.strand_stiffness *= f; });
    uncertain("creep", "compliance", per(position_unit(s_), effort_unit(s_)), c.creep_compliance,
              stretch, [](CableNumbers& n, double f) { n.creep_compliance *= f; });
    uncertain("backlash", "half_width", position_unit(s_), c.gap_half_width, stretch,
              [](CableNumbers& n, double f) { n.gap_half_width *= f; });
    // How far friction behind the cable yields before it slips is microphysics: see
    // dry_friction_of_drive().
    if (c.friction_level > 0.0) {
      uncertain("joint_friction", "presliding", position_unit(s_), c.friction_presliding, stretch,
                [](CableNumbers& n, double f) { n.friction_presliding *= f * f * f; });
      nominal_.terms.back().form_only = true;
      nominal_.terms.back().tolerance = 1.0;
      friction_starts();
    }
  }

  /// Which side friction behind the cable was left on before a start is a state, not physics: it
  /// lasts until the joint has moved, and no side is likelier.
  void friction_starts() {
    CableNumbers left = s_.cable;
    left.friction_start = 1.0;
    CableNumbers right = s_.cable;
    right.friction_start = -1.0;
    const VectorXd half = 0.5 * (cable_stretch(s_, right) - cable_stretch(s_, left));
    for (Index first = 0, last = 0; first < s_.rows(); first = last) {
      last = first + 1;
      while (last < s_.rows() && s_.fresh[static_cast<std::size_t>(last)] == 0) ++last;
      const auto part = half.segment(first, last - first);
      const bool seen = part.cwiseAbs().maxCoeff() > s_.rest_width();
      if (!seen || kMostStarts * (last - first) < s_.rows() ||
          s_.held_out[static_cast<std::size_t>(first)] != 0)
        continue;
      VectorXd column = VectorXd::Zero(s_.rows());
      column.segment(first, last - first) = part;
      nominal_.terms.push_back(
          {"joint_friction", "start_side", "1", 0.0, kSideDeviation, std::move(column), true});
    }
  }

  void wander() { slow_changes("thermal_drift", "wander", s_.unit, VectorXd::Ones(s_.rows())); }

  /// A slow change that the plant admits is no finding: per recording its slow cosines, each with
  /// the deviation that an Ornstein-Uhlenbeck process has there, 2 S(w) / length with
  /// S(w) = 2 deviation^2 time / (1 + (w time)^2). Over a recording so long that most of the change
  /// is faster, it averages out. Held-out rows have their own, which nobody knows. `column`: change
  /// of the residual per unit of what changes.
  void slow_changes(const std::string& id, const std::string& parameter, const std::string& unit,
                    const VectorXd& column) {
    const double deviation = joint_.parameter(id, parameter);
    const double time_s = std::max(1.0, joint_.parameter(id, parameter + "_time"));
    if (deviation <= 0.0) return;
    for (Index first = 0, last = 0; first < s_.rows(); first = last) {
      const auto recording = s_.recording[static_cast<std::size_t>(first)];
      while (last < s_.rows() && s_.recording[static_cast<std::size_t>(last)] == recording) ++last;
      const Index rows = last - first;
      const double length_s = s_.t_s[last - 1] - s_.t_s[first];
      if (s_.held_out[static_cast<std::size_t>(first)] != 0 || length_s <= 0.0) continue;
      if (length_s > kLongForSlow * time_s) continue;
      for (int k = 1; k <= kSlowCosines; ++k) {
        const double w = std::numbers::pi * k / length_s;
        const double spread = std::sqrt(4.0 * deviation * deviation * time_s /
                                        (1.0 + w * w * time_s * time_s) / length_s);
        VectorXd part = VectorXd::Zero(s_.rows());
        part.segment(first, rows) =
            kKnownDeviation * spread * column.segment(first, rows).array() *
            (w * (s_.t_s.segment(first, rows).array() - s_.t_s[first])).cos();
        nominal_.terms.push_back({id, parameter, unit, 0.0, 1.0, std::move(part), true});
      }
    }
  }

  /// A load that the drive alone found is friction that looks like one, unless the cable feels it
  /// as well: none, all and twice of it are as likely here.
  void found_load(const VectorXd& stretch) {
    if (s_.found_load.size() == 0) return;
    const VectorXd known = s_.weight - s_.found_load;
    const double found = s_.training_rms(s_.found_load);
    if (found < 0.1 * s_.training_rms(known) || s_.training_rms(known) < 0.1 * found) return;
    const VectorXd without =
        replay_cable({s_.t_s, s_.motion.q, known, s_.inertial, s_.fresh, s_.rest_width()}, s_.cable)
            .stretch;
    nominal_.terms.push_back({"gravity", "found_share", "1", 1.0, 0.8, without - stretch, true});
  }

  /// A constant effort of the drive is a weight that the cable carries or an error of the drive's
  /// own: none and all of it are as likely. It adds a constant and nothing else: beside a free one
  /// it gives a fit no freedom.
  void constant_load() {
    const double stretch = s_.constant_load * s_.cable.compliance;
    if (stretch == 0.0) return;
    const VectorXd half = VectorXd::Constant(s_.rows(), -0.5 * stretch);
    nominal_.prediction += half;
    nominal_.terms.push_back({"gravity", "constant_load", "1", 0.5, 1.0, half, true});
  }

  template <typename Change>
  void uncertain(const std::string& id, const std::string& parameter, const std::string& unit,
                 double value, const VectorXd& stretch, Change&& change) {
    if (value == 0.0) return;
    constexpr double kStep = 0.05;
    CableNumbers changed = s_.cable;
    change(changed, 1.0 + kStep);
    nominal_.terms.push_back({id, parameter, unit, value, tolerance_of(joint_, id, parameter),
                              (stretch - cable_stretch(s_, changed)) / kStep});
  }

  /// The motor's share of the joint's position: what a wrong ratio multiplies.
  [[nodiscard]] VectorXd motor_part() const {
    VectorXd part = s_.motion.q;
    for (const Companion& other : s_.others) {
      const auto k = plant_.joint_index(other.name);
      if (k && index_ < plant_.coupling.size()) part -= plant_.coupling[index_][*k] * other.value;
    }
    return part;
  }

  const Series& s_;
  const physics::Plant& plant_;
  std::size_t index_;
  const physics::Joint& joint_;
  Nominal nominal_;
};

}  // namespace

physics::JointSignals signals_of(const Series& s) {
  const auto other = [&s](const std::string& name) {
    if (name == s.joint) return s.motion.q;
    for (const std::vector<Companion>* list : {&s.others, &s.loads}) {
      for (const Companion& companion : *list)
        if (companion.name == name) return companion.value;
    }
    return VectorXd();
  };
  return {s.t_s, s.fresh, s.motion.q, other, s.driven};
}

double tolerance_of(const physics::Joint& joint, const std::string& id,
                    const std::string& parameter) {
  for (const std::string& key : {id + "." + parameter, id + "_" + parameter, parameter, id}) {
    const auto it = joint.tolerance.find(key);
    if (it != joint.tolerance.end()) return it->second;
  }
  return 0.10;
}

Nominal nominal_of(const Series& series, const physics::Plant& plant) {
  const auto index = plant.joint_index(series.joint);
  NominalBuilder builder(series, plant, index.value_or(0));
  if (series.stage == Stage::kDrive) builder.drive();
  if (series.stage == Stage::kTransmission) builder.transmission();
  if (series.stage == Stage::kTransmission || series.stage == Stage::kTracking) builder.shapes();
  return builder.take();
}

bool plant_has(const physics::Plant& plant, const std::string& joint, const std::string& id,
               const std::string& from) {
  const auto index = plant.joint_index(joint);
  if (!index) return false;
  const physics::Joint& j = plant.joints[*index];
  return std::any_of(j.effects.begin(), j.effects.end(), [&](const physics::Effect& effect) {
    return effect.id == id && (from.empty() || effect.from == from);
  });
}

}  // namespace ravencal::diagnose
