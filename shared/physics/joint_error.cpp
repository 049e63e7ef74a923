// SPDX-License-Identifier: Apache-2.0
#include "physics/joint_error.hpp"

#include <fmt/format.h>

#include <cmath>

#include "physics/effects/eccentricity.hpp"
#include "physics/effects/slip_element.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double value(const Effect& effect, std::string_view name) {
  const auto it = effect.parameters.find(name);
  return it == effect.parameters.end() ? 0.0 : it->second;
}

/// Elastic-slip element over `width`, -1 to 1: the side on which the motion left the joint.
VectorXd side(const VectorXd& x, double width, const std::vector<char>& fresh) {
  VectorXd out = VectorXd::Zero(x.size());
  for (Index i = 1; i < x.size(); ++i) {
    const double moved = 2.0 * (x[i] - x[i - 1]) / width;
    if (fresh[static_cast<std::size_t>(i)] == 0 && std::isfinite(moved))
      out[i] = slipped(out[i - 1], moved);
  }
  return out;
}

VectorXd loop(const Effect& e, const VectorXd& x, const std::vector<char>& fresh) {
  const double narrow = value(e, "half_loop_narrow");
  const double wide = value(e, "half_loop_wide");
  const std::array halves = {narrow, value(e, "half_loop") - narrow - wide, wide};
  VectorXd error = VectorXd::Zero(x.size());
  for (std::size_t i = 0; i < kLoopWidths.size(); ++i)
    error -= halves[i] * side(x, kLoopWidths[i] * value(e, "width"), fresh);
  return error;
}

VectorXd signal(const JointSignals& s, const std::string& name) {
  return name.empty() ? VectorXd() : s.other(name);
}

/// What an effect adds that is described by its shape; empty for others. `followed`: the joint as
/// its own loops see it.
VectorXd shape_of(const Effect& e, const JointSignals& s, const VectorXd& followed) {
  const VectorXd& q = s.position;
  if (e.id == "homing_offset") return VectorXd::Constant(q.size(), value(e, "offset"));
  if (e.id == "delay") return later(s.t_s, s.fresh, q, value(e, "delay")) - q;
  if (e.id == "coulomb_friction" && value(e, "width") > 0.0 && s.driven.size() > 0)
    return -value(e, "lag") * side(s.driven, value(e, "width"), s.fresh);
  if (e.id == "joint_friction" && value(e, "width") > 0.0)
    return -value(e, "stretch") * side(followed, value(e, "width"), s.fresh);
  const VectorXd other = signal(s, e.from);
  const bool named = !e.from.empty() && other.size() == q.size();
  if (e.id == "hysteresis" && value(e, "width") > 0.0 && (named || e.from.empty()))
    return loop(e, named ? other : followed, s.fresh);
  if (e.id != "compliance" || !named) return {};
  VectorXd per_load = VectorXd::Constant(q.size(), value(e, "stretch_per_load"));
  const VectorXd posture = signal(s, e.posture);
  if (posture.size() == q.size()) per_load += value(e, "stretch_per_load_and_posture") * posture;
  return -per_load.cwiseProduct(other) -
         value(e, "stiffening_per_load2") * other.cwiseProduct(other.cwiseAbs());
}

VectorXd play(const Joint& joint, const VectorXd& followed, const std::vector<char>& fresh) {
  const double half_width = joint.parameter("backlash", "half_width");
  if (half_width <= 0.0) return VectorXd::Zero(followed.size());
  return -half_width * side(followed, 2.0 * half_width, fresh);
}

/// What the other effects add; zero for those that need an effort to be known.
VectorXd motion_part(const Joint& joint, const Effect& e, const JointSignals& s,
                     const VectorXd& followed) {
  const VectorXd& q = s.position;
  if (e.id == "gain_error") return value(e, "ratio") * q;
  if (e.id == "coupling") return value(e, "error") * signal(s, e.from);
  if (e.id == "eccentricity") {
    const VectorXd& motor = s.driven.size() > 0 ? s.driven : q;
    return motor.unaryExpr([&](double at) { return Eccentricity(joint).at(at); });
  }
  if (e.id == "thermal_drift" && value(e, "time") > 0.0) {
    return value(e, "final") * (1.0 - (-(s.t_s.array() - s.t_s[0]) / value(e, "time")).exp());
  }
  if (e.id == "backlash") return play(joint, followed, s.fresh);
  return VectorXd::Zero(q.size());
}

}  // namespace

VectorXd later(const VectorXd& t_s, const std::vector<char>& fresh, const VectorXd& values,
               double late_s) {
  VectorXd out = values;
  const Index rows = values.size();
  const auto starts = [&](Index i) { return fresh[static_cast<std::size_t>(i)] != 0; };
  Index behind = 0;
  for (Index i = 0; i < rows; ++i) {
    if (starts(i)) behind = i;
    const double then_s = t_s[i] - late_s;
    const auto has_next = [&] { return behind + 1 < rows && !starts(behind + 1); };
    while (has_next() && t_s[behind + 1] <= then_s) ++behind;
    out[i] = values[behind];
    if (!has_next() || then_s <= t_s[behind]) continue;
    const double share = (then_s - t_s[behind]) / (t_s[behind + 1] - t_s[behind]);
    out[i] += share * (values[behind + 1] - values[behind]);
  }
  return out;
}

VectorXd moved_by_others(const Joint& joint, const JointSignals& s) {
  VectorXd moved = VectorXd::Zero(s.position.size());
  for (const Effect& e : joint.effects) {
    const VectorXd other = signal(s, e.from);
    if (other.size() != moved.size()) continue;
    if (e.id == "coupling") moved += value(e, "error") * other;
    if (e.id == "hysteresis" && value(e, "width") > 0.0) moved += loop(e, other, s.fresh);
  }
  return moved;
}

VectorXd play_error(const Joint& joint, const JointSignals& s) {
  return play(joint, s.position + moved_by_others(joint, s), s.fresh);
}

VectorXd shape_error(const Joint& joint, const JointSignals& s) {
  VectorXd error = VectorXd::Zero(s.position.size());
  const VectorXd followed = s.position + moved_by_others(joint, s);
  for (const Effect& effect : joint.effects) {
    const VectorXd part = shape_of(effect, s, followed);
    if (part.size() > 0) error += part;
  }
  return error;
}

core::Status check_signals(const Joint& joint,
                           const std::function<bool(const std::string&)>& recorded) {
  for (const Effect& effect : joint.effects) {
    for (const std::string& name : {effect.from, effect.posture}) {
      if (name.empty() || recorded(name)) continue;
      return core::Error{core::ErrorCode::kData,
                         fmt::format("joint '{}': {} from '{}', which was not recorded", joint.name,
                                     effect.id, name)};
    }
  }
  return {};
}

core::Result<VectorXd> joint_error(const Joint& joint, const JointSignals& s) {
  RAVENCAL_RETURN_IF_ERROR(
      check_signals(joint, [&](const std::string& name) { return s.other(name).size() > 0; }));
  VectorXd error = VectorXd::Zero(s.position.size());
  const VectorXd followed = s.position + moved_by_others(joint, s);
  for (const Effect& effect : joint.effects) {
    const VectorXd part = shape_of(effect, s, followed);
    error += part.size() > 0 ? part : motion_part(joint, effect, s, followed);
  }
  return error;
}

}  // namespace ravencal::physics
