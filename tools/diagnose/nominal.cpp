// SPDX-License-Identifier: Apache-2.0
#include "diagnose/nominal.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/effects/shapes.hpp"
#include "physics/effects/hysteresis.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double tolerance_of(const physics::Joint& joint, const std::string& id,
                    const std::string& parameter) {
  for (const std::string& key : {id + "." + parameter, id + "_" + parameter, parameter, id}) {
    const auto it = joint.tolerance.find(key);
    if (it != joint.tolerance.end()) return it->second;
  }
  return 0.10;
}

/// The cable's numbers, as far as they act quasi-statically.
struct CableNumbers {
  double compliance = 0.0;  ///< 1 / stiffness
  double friction_level = 0.0;
  double friction_presliding = 0.0;
  double friction_load_share = 0.0;
  double hysteresis_stiffness = 0.0;
  double hysteresis_yield = 0.0;
  double creep_compliance = 0.0;
  double creep_time_s = 1.0;
  double gap_half_width = 0.0;
};

/// Stretch that balances `load` against spring and hysteresis; the hysteresis moves on.
double balanced_stretch(double load, double last, const CableNumbers& c,
                        physics::Hysteresis& strands) {
  const double stiffness = 1.0 / c.compliance;
  const double span = std::abs(load) * c.compliance + c.hysteresis_yield + std::abs(last);
  double low = -2.0 * span;
  double high = 2.0 * span;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    physics::Hysteresis trial = strands;
    (stiffness * middle + trial.step(middle - last) < load ? low : high) = middle;
  }
  const double stretch = 0.5 * (low + high);
  strands.step(stretch - last);
  return stretch;
}

VectorXd cable_stretch(const Series& s, const CableNumbers& c) {
  VectorXd load = s.weight.size() > 0 ? s.weight : VectorXd(VectorXd::Zero(s.rows()));
  if (c.friction_level > 0.0) {
    const double width = std::max(2.0 * c.friction_presliding, s.rest_width());
    const VectorXd side = direction_memory(s.motion.q, width, s.fresh);
    load +=
        side.cwiseProduct((c.friction_level + c.friction_load_share * load.array().abs()).matrix());
  }
  VectorXd stretch = c.compliance * load;
  if (c.hysteresis_stiffness > 0.0 && c.hysteresis_yield > 0.0) {
    physics::Hysteresis strands(c.hysteresis_stiffness, c.hysteresis_yield);
    double last = 0.0;
    for (Index i = 0; i < s.rows(); ++i) {
      if (s.fresh[static_cast<std::size_t>(i)] != 0) {
        strands = physics::Hysteresis(c.hysteresis_stiffness, c.hysteresis_yield);
        last = 0.0;
      }
      last = balanced_stretch(load[i], last, c, strands);
      stretch[i] = last;
    }
  }
  if (c.gap_half_width > 0.0) {
    // The gap closes over 2 % of the load's range instead of at one point.
    const double scale = std::max(1e-12, 0.02 * load.cwiseAbs().maxCoeff());
    stretch += (c.gap_half_width * (load.array() / scale).max(-1.0).min(1.0)).matrix();
  }
  if (c.creep_compliance > 0.0) {
    stretch += c.creep_compliance * low_pass(load, s.t_s, c.creep_time_s, s.fresh);
  }
  return stretch;
}

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
    if (s_.weight.size() > 0) linear("gravity", "weight_scale", "1", 1.0, s_.weight);
    const std::string damping = s_.prismatic ? "N_s_per_m" : "N_m_s_per_rad";
    linear("coulomb_friction", "level", s_.unit, joint_.parameter("coulomb_friction", "level"),
           s_.as_seen(direction(s_)));
    linear("viscous_friction", "damping", damping, joint_.parameter("viscous_friction", "damping"),
           s_.motion.v);
    const double velocity = joint_.parameter("stribeck_friction", "velocity");
    if (velocity > 0.0) {
      const VectorXd shape =
          direction(s_).array() / (1.0 + (s_.motion.v.array() / velocity).square());
      linear("stribeck_friction", "extra", s_.unit, joint_.parameter("stribeck_friction", "extra"),
             s_.as_seen(shape));
    }
    const double behind = joint_.parameter("joint_friction", "level");
    if (behind > 0.0) {
      const double width =
          std::max(2.0 * joint_.parameter("joint_friction", "presliding"), s_.rest_width());
      linear("joint_friction", "level", s_.unit, behind,
             s_.as_seen(direction_memory(s_.motion.q, width, s_.fresh)));
    }
    // Recorded effort is the needed one over 1 + ratio.
    const double ratio = joint_.parameter("torque_constant", "ratio");
    if (ratio == 0.0) return;
    nominal_.prediction /= 1.0 + ratio;
    for (NominalTerm& term : nominal_.terms) term.column /= 1.0 + ratio;
  }

  void transmission() {
    linear("gain_error", "ratio", "1", joint_.parameter("gain_error", "ratio"), motor_part());
    // A reading of the truth is stamped late by its transfer and is half a period old on average;
    // how late is the recorder's matter, hence the wide tolerance.
    if (plant_.logger.truth_latency_s > 0.0) {
      linear("delay", "truth_latency", "s",
             plant_.logger.truth_latency_s + 0.5 * plant_.logger.truth_period_s, -s_.motion.v);
      nominal_.terms.back().tolerance = 1.0;
    }
    for (const physics::Effect& effect : joint_.effects) {
      if (effect.id != "coupling") continue;
      for (const Companion& other : s_.others) {
        if (other.name != effect.from) continue;
        linear("coupling", "error", per(s_.unit, other.unit),
               effect.parameters.find("error")->second, other.value);
      }
    }
    const double order = joint_.parameter("eccentricity", "order");
    const double phase = joint_.parameter("eccentricity", "phase");
    linear("eccentricity", "amplitude", s_.unit, joint_.parameter("eccentricity", "amplitude"),
           (order * s_.motion.q.array() + phase).sin().matrix());
    cable();
  }

  Nominal take() { return std::move(nominal_); }

 private:
  void cable() {
    const double stiffness = joint_.parameter("compliance", "stiffness");
    if (stiffness <= 0.0) return;
    CableNumbers c;
    c.compliance = 1.0 / stiffness;
    c.friction_level = joint_.parameter("joint_friction", "level");
    c.friction_presliding = joint_.parameter("joint_friction", "presliding");
    c.friction_load_share = joint_.parameter("joint_friction", "load_share");
    c.hysteresis_stiffness = joint_.parameter("hysteresis", "stiffness");
    c.hysteresis_yield = joint_.parameter("hysteresis", "yield");
    c.creep_compliance = joint_.parameter("creep", "compliance");
    c.creep_time_s = std::max(1e-3, joint_.parameter("creep", "time"));
    c.gap_half_width = joint_.parameter("backlash", "half_width");
    const VectorXd stretch = cable_stretch(s_, c);
    nominal_.prediction -= stretch;
    const std::string stiffness_unit = per(effort_unit(s_), position_unit(s_));
    // 1 / k: a relative change of the stiffness is minus that of the compliance.
    uncertain("compliance", "stiffness", stiffness_unit, stiffness, c, stretch,
              [](CableNumbers& n, double f) { n.compliance /= f; });
    uncertain("joint_friction", "level", effort_unit(s_), c.friction_level, c, stretch,
              [](CableNumbers& n, double f) { n.friction_level *= f; });
    uncertain("hysteresis", "stiffness", stiffness_unit, c.hysteresis_stiffness, c, stretch,
              [](CableNumbers& n, double f) { n.hysteresis_stiffness *= f; });
    uncertain("creep", "compliance", per(position_unit(s_), effort_unit(s_)), c.creep_compliance, c,
              stretch, [](CableNumbers& n, double f) { n.creep_compliance *= f; });
    uncertain("backlash", "half_width", position_unit(s_), c.gap_half_width, c, stretch,
              [](CableNumbers& n, double f) { n.gap_half_width *= f; });
  }

  template <typename Change>
  void uncertain(const std::string& id, const std::string& parameter, const std::string& unit,
                 double value, const CableNumbers& numbers, const VectorXd& stretch,
                 Change&& change) {
    if (value == 0.0) return;
    constexpr double kStep = 0.05;
    CableNumbers changed = numbers;
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

Nominal nominal_of(const Series& series, const physics::Plant& plant) {
  const auto index = plant.joint_index(series.joint);
  NominalBuilder builder(series, plant, index.value_or(0));
  if (series.stage == Stage::kDrive) builder.drive();
  if (series.stage == Stage::kTransmission) builder.transmission();
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
