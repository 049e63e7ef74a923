// SPDX-License-Identifier: Apache-2.0
//
// Where joints stand and where they read zero, as numbers of plants that state their frames.
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "diagnose/vocabulary/candidates.hpp"
#include "diagnose/vocabulary/setters.hpp"
#include "physics/tolerance_keys.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Along the line from the carrier to the joint, along the carrier's axis, and across both.
constexpr std::array<const char*, 3> kLinkIds = {"link_length", "link_axial", "link_across"};
constexpr const char* kZeroId = "joint_zero";
/// Sizes at which they are tried, m and rad.
constexpr double kLinkStart_m = 0.01;
constexpr double kZeroStart_rad = 0.01;
/// Axes nearer to each other than this count as parallel, rad; lengths below are none, m.
constexpr double kParallel = 1e-6;

Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
Quaterniond rotation_of(const physics::Frame& frame) {
  return {frame.rotation[0], frame.rotation[1], frame.rotation[2], frame.rotation[3]};
}
bool parallel(const Vector3d& a, const Vector3d& b) {
  return a.normalized().cross(b.normalized()).norm() < kParallel;
}

class Geometry {
 public:
  Geometry(const physics::Plant& plant, const Scales& scales)
      : plant_(plant), joint_(plant.joints[scales.joint]), s_(scales) {}

  /// Every number of the joint's place that efforts can depend on.
  [[nodiscard]] std::vector<Parameter> parameters() const {
    std::vector<Parameter> out;
    if (!joint_.frame || !s_.effort || !(s_.weight_load > 0.0)) return out;
    const std::array<Vector3d, 3> directions = link_directions();
    for (std::size_t d = 0; d < directions.size(); ++d)
      if (directions[d].norm() > kParallel && shows(directions[d]))
        out.push_back(link(kLinkIds[d], directions[d].normalized()));
    if (zero_shows()) out.push_back(zero());
    return out;
  }

 private:
  /// Of kLinkIds, orthogonal, in the carrier's frame; zero where there is none. They do not depend
  /// on how the frame's own axes were laid.
  [[nodiscard]] std::array<Vector3d, 3> link_directions() const {
    const physics::Frame& frame = *joint_.frame;
    if (frame.carried_by.empty()) return {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    const Vector3d axis =
        vector_of(plant_.joints[*plant_.joint_index(frame.carried_by)].frame->axis);
    const Vector3d link = vector_of(frame.position_m);
    const Vector3d across = axis.cross(link);
    if (link.norm() <= kParallel) return {Vector3d::Zero(), axis, Vector3d::Zero()};
    if (across.norm() <= kParallel) return {link, Vector3d::Zero(), Vector3d::Zero()};
    return {link, link.cross(across), across};
  }

  /// Whether it matters that the joint stands further that way in its carrier: not along axes about
  /// which the whole arm turns, and not at the base.
  [[nodiscard]] bool shows(Vector3d direction) const {
    std::string carrier = joint_.frame->carried_by;
    while (!carrier.empty()) {
      const physics::Joint& by = plant_.joints[*plant_.joint_index(carrier)];
      const bool turns = by.kind == physics::JointKind::kRevolute;
      if (turns && !parallel(direction, vector_of(by.frame->axis))) return true;
      direction = rotation_of(*by.frame) * direction;
      carrier = by.frame->carried_by;
    }
    return false;
  }

  /// A joint at the base whose axis is plumb stands before the same weights wherever its zero is.
  [[nodiscard]] bool zero_shows() const {
    if (joint_.kind != physics::JointKind::kRevolute) return false;
    const Vector3d gravity = vector_of(plant_.robot.gravity_m_per_s2);
    const Vector3d axis = rotation_of(*joint_.frame) * vector_of(joint_.frame->axis);
    return !joint_.frame->carried_by.empty() || (gravity.norm() > 0.0 && !parallel(axis, gravity));
  }

  [[nodiscard]] Parameter number(const char* id, const char* name, const char* unit,
                                 double start) const {
    Parameter p = parameter_of(s_, id, name, Reaches::kEverything);
    p.unit = unit;
    p.scale = start;
    p.deviation = kUnknownSize;
    p.step = 1.0;
    return p;
  }
  [[nodiscard]] Parameter link(const char* id, const Vector3d& direction) const {
    Parameter p = number(id, "offset", "m", kLinkStart_m);
    p.set = along(
        s_.joint, direction, vector_of(joint_.frame->position_m),
        [](auto& joint) -> auto& { return joint.frame->position_m; });
    return p;
  }
  [[nodiscard]] Parameter zero() const {
    Parameter p = number(kZeroId, "offset", "rad", kZeroStart_rad);
    p.set = [joint = s_.joint, given = rotation_of(*joint_.frame),
             axis = vector_of(joint_.frame->axis)](State& state, double value) {
      const Quaterniond turned = given * Quaterniond(Eigen::AngleAxisd(value, axis));
      state.plant.joints[joint].frame->rotation = {turned.w(), turned.x(), turned.y(), turned.z()};
    };
    return p;
  }

  const physics::Plant& plant_;
  const physics::Joint& joint_;
  const Scales& s_;
};

/// Relative to the length of the link, or to a radian; 0 where the plant states none.
double stated_deviation(const physics::Joint& joint, const Parameter& p) {
  const auto stated = joint.tolerance.find(p.effect);
  if (stated == joint.tolerance.end()) return 0.0;
  const double length = p.effect == kZeroId ? 1.0 : vector_of(joint.frame->position_m).norm();
  return kDeviationPerTolerance * stated->second * length / p.scale;
}

}  // namespace

void add_geometry(const physics::Plant& plant, const Scales& scales,
                  std::vector<Parameter>& numbers, std::vector<Candidate>& candidates) {
  for (Parameter& p : Geometry(plant, scales).parameters()) {
    const double deviation = stated_deviation(plant.joints[scales.joint], p);
    if (!(deviation > 0.0)) continue;
    Candidate& c = candidates.emplace_back();
    c.id = p.effect;
    c.joint = scales.joint;
    c.wrong_number = true;
    c.kind = CandidateKind::kNumber;
    c.opens = numbers.size();
    c.opened = p;
    p.deviation = deviation;
    p.step = 0.5 * deviation;
    numbers.push_back(std::move(p));
  }
}

}  // namespace ravencal::diagnose
