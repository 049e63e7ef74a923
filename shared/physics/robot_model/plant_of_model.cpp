// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/plant_of_model.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "physics/drives.hpp"
#include "physics/plant_ranges.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d vector_at(const mjtNum* values, int place) {
  return Eigen::Map<const Vector3d>(values + 3 * static_cast<Index>(place));
}
Quaterniond turn_at(const mjtNum* values, int place) {
  const mjtNum* q = values + 4 * static_cast<Index>(place);
  return {q[0], q[1], q[2], q[3]};
}
std::array<double, 3> array_of(const Vector3d& v) { return {v[0], v[1], v[2]}; }

/// Mass, first moment and second moments about one point.
struct Inertia {
  double mass_kg = 0.0;
  Vector3d moment = Vector3d::Zero();  ///< kg m
  Matrix3d about = Matrix3d::Zero();   ///< kg m^2, about the point

  void add(double mass, const Vector3d& com, const Matrix3d& about_com) {
    mass_kg += mass;
    moment += mass * com;
    about += about_com + mass * (com.squaredNorm() * Matrix3d::Identity() - com * com.transpose());
  }
  [[nodiscard]] Vector3d com() const {
    return mass_kg > 0.0 ? Vector3d(moment / mass_kg) : Vector3d(Vector3d::Zero());
  }
  [[nodiscard]] Matrix3d about_com() const {
    const Vector3d c = com();
    return about - mass_kg * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  }
};

/// A link before its frame is turned to its principal axes.
struct RawLink {
  int joint = -1;                         ///< of the model
  int carried_by = -1;                    ///< place of the link that carries it; -1: the base
  Isometry3d at{Isometry3d::Identity()};  ///< in that link's raw frame
  Inertia inertia;                        ///< in its own raw frame
  Matrix3d axes = Matrix3d::Identity();   ///< principal axes, in the raw frame
};

/// A limit that no plant can state, such as 1e16, is how models say that there is none.
std::optional<double> within(const core::NumberRange& range, double limit) {
  if (limit < range.low || limit > range.high) return std::nullopt;
  return limit;
}

class Importer {
 public:
  Importer(const mjModel& model, const std::string& source, const ModelWords& words)
      : m_(model), words_(words) {
    plant_.source = source;
    plant_.robot.name = m_.names[0] != '\0' ? m_.names : "robot";
    std::copy_n(m_.opt.gravity, 3, plant_.robot.gravity_m_per_s2.begin());
    plant_.robot.control_rate_hz = 1000.0;
    plant_.robot.inner_rate_hz = 10000.0;
  }

  core::Result<Plant> plant() && {
    for (int j = 0; j < m_.njnt; ++j)
      if (m_.jnt_type[j] != mjJNT_HINGE && m_.jnt_type[j] != mjJNT_SLIDE)
        return core::data_error(fmt::format(
            "{}: joint '{}' is neither a hinge nor a slide; a plant stands on the ground and has "
            "joints of one degree of freedom",
            plant_.source, joint_name(m_, j)));
    if (m_.njnt == 0) return core::data_error(fmt::format("{}: has no joint", plant_.source));
    walk();
    for (std::size_t k = 0; k < links_.size(); ++k) add_joint(k);
    place_payload();
    add_series();
    plant_.coupling.assign(links_.size(), std::vector<double>(links_.size(), 0.0));
    add_couplings();
    add_actuators();
    add_words();
    note_rest();
    return std::move(plant_);
  }

 private:
  [[nodiscard]] std::string actuator_name(int id) const {
    const char* name = mj_id2name(&m_, mjOBJ_ACTUATOR, id);
    return name != nullptr && *name != '\0' ? std::string(name) : fmt::format("{}", id);
  }
  /// Place of the model's joint in the plant; -1: it is none of its joints.
  [[nodiscard]] int place_of(int joint) const {
    const auto at = std::find_if(links_.begin(), links_.end(),
                                 [&](const RawLink& link) { return link.joint == joint; });
    return at == links_.end() ? -1 : static_cast<int>(at - links_.begin());
  }
  void note(std::string text) { plant_.notes.push_back(std::move(text)); }

  /// Bodies stand in the model in an order in which parents come first.
  void walk() {
    std::vector<int> carrier(static_cast<std::size_t>(m_.nbody), -1);
    std::vector<Isometry3d> place(static_cast<std::size_t>(m_.nbody), Isometry3d::Identity());
    for (int b = 1; b < m_.nbody; ++b) {
      const auto parent = static_cast<std::size_t>(m_.body_parentid[b]);
      Isometry3d at = place[parent] * pose(vector_at(m_.body_pos, b), turn_at(m_.body_quat, b));
      int link = carrier[parent];
      for (int n = 0; n < m_.body_jntnum[b]; ++n) {
        const int j = m_.body_jntadr[b] + n;
        if (series_joint(m_, j)) continue;
        const Vector3d anchor = vector_at(m_.jnt_pos, j);
        const Vector3d axis = vector_at(m_.jnt_axis, j);
        const double zero = m_.qpos0[m_.jnt_qposadr[j]];
        // The model's pose is that at qpos0; the plant's is at zero.
        Isometry3d back = Isometry3d::Identity();
        if (m_.jnt_type[j] == mjJNT_HINGE)
          back.linear() = Eigen::AngleAxisd(-zero, axis).toRotationMatrix();
        else
          back.translation() = -zero * axis;
        links_.push_back({j, link, at * Eigen::Translation3d(anchor) * back, {}});
        link = static_cast<int>(links_.size()) - 1;
        at = Isometry3d(Eigen::Translation3d(-anchor));
      }
      carrier[static_cast<std::size_t>(b)] = link;
      place[static_cast<std::size_t>(b)] = at;
      if (link < 0) continue;
      // Each new link starts without a tool; the last one keeps its own.
      if (m_.body_jntnum[b] > 0)
        tool_.setZero();
      else if (at.translation().norm() > tool_.norm())
        tool_ = at.translation();
      const Matrix3d turn = (at.linear() * turn_at(m_.body_iquat, b).toRotationMatrix());
      const Matrix3d about_com =
          turn * vector_at(m_.body_inertia, b).asDiagonal() * turn.transpose();
      links_[static_cast<std::size_t>(link)].inertia.add(
          m_.body_mass[b], at * vector_at(m_.body_ipos, b), about_com);
    }
    for (RawLink& link : links_) {
      const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(link.inertia.about_com());
      link.axes = solver.eigenvectors();
      if (link.axes.determinant() < 0.0) link.axes.col(0) *= -1.0;
    }
  }

  /// On what the last link carries farthest from its joint; without such a body, in the link's
  /// middle.
  void place_payload() {
    const Link& link = plant_.joints.back().link;
    const bool far = tool_.norm() > 0.0;
    plant_.payload.com_m = far ? array_of(links_.back().axes.transpose() * tool_) : link.com_m;
  }

  static Isometry3d pose(const Vector3d& position, const Quaterniond& turn) {
    return Eigen::Translation3d(position) * turn;
  }

  void add_joint(std::size_t k) {
    const RawLink& raw = links_[k];
    const int j = raw.joint;
    const int dof = m_.jnt_dofadr[j];
    Joint joint;
    joint.name = joint_name(m_, j);
    joint.kind = m_.jnt_type[j] == mjJNT_SLIDE ? JointKind::kPrismatic : JointKind::kRevolute;
    joint.motor_inertia_kg_m2 = std::max(kNoInertia_kg_m2, m_.dof_armature[dof]);
    Isometry3d at = raw.at;
    if (raw.carried_by >= 0) {
      const RawLink& carrier = links_[static_cast<std::size_t>(raw.carried_by)];
      at = Isometry3d(carrier.axes.transpose()) * at;
    }
    const Quaterniond turn(at.linear() * raw.axes);
    Frame frame;
    if (raw.carried_by >= 0)
      frame.carried_by = plant_.joints[static_cast<std::size_t>(raw.carried_by)].name;
    frame.position_m = array_of(at.translation());
    frame.rotation = {turn.w(), turn.x(), turn.y(), turn.z()};
    frame.axis = array_of(raw.axes.transpose() * vector_at(m_.jnt_axis, j));
    joint.frame = frame;
    joint.link.mass_kg = raw.inertia.mass_kg;
    joint.link.com_m = array_of(raw.axes.transpose() * raw.inertia.com());
    const Matrix3d principal = raw.axes.transpose() * raw.inertia.about_com() * raw.axes;
    joint.link.inertia_kg_m2 = array_of(principal.diagonal().cwiseMax(0.0));
    const auto effect = [&](const char* id, const char* parameter, double value) {
      if (value > 0.0) joint.effects.push_back({id, "", {{parameter, value}}});
    };
    effect("coulomb_friction", "level", m_.dof_frictionloss[dof]);
    effect("viscous_friction", "damping", m_.dof_damping[dof]);
    if (m_.jnt_limited[j] != 0) {
      const mjtNum* range = m_.jnt_range + 2 * static_cast<Index>(j);
      joint.limits.low_ji = within(kPositionRange, range[0]);
      joint.limits.high_ji = within(kPositionRange, range[1]);
    }
    if (m_.jnt_stiffness[j] != 0.0)
      note(fmt::format("joint {}'s spring of {:g} is left out: a plant has no spring to a position",
                       joint.name, m_.jnt_stiffness[j]));
    plant_.joints.push_back(std::move(joint));
  }

  void add_series() {
    for (int j = 0; j < m_.njnt; ++j) {
      const std::optional<SeriesJoint> series = series_joint(m_, j);
      if (!series) continue;
      const int dof = m_.jnt_dofadr[j];
      Joint& joint = plant_.joints[static_cast<std::size_t>(place_of(series->of))];
      const bool is_cable = series->kind == SeriesKind::kCable;
      if (is_cable)
        joint.effects.push_back(
            {"compliance",
             "",
             {{"stiffness", m_.jnt_stiffness[j]}, {"damping", m_.dof_damping[dof]}}});
      else
        joint.effects.push_back(
            {"backlash", "", {{"half_width", m_.jnt_range[2 * static_cast<Index>(j) + 1]}}});
      const bool resists =
          m_.dof_frictionloss[dof] > 0.0 || (!is_cable && m_.dof_damping[dof] > 0.0);
      if (resists)
        note(fmt::format("what joint {} resists by friction is left out", joint_name(m_, j)));
    }
  }

  /// A joint that an equality makes a multiple of one before it.
  void add_couplings() {
    for (int e = 0; e < m_.neq; ++e) {
      const mjtNum* c = m_.eq_data + static_cast<Index>(e) * mjNEQDATA;
      const bool of_joints = m_.eq_type[e] == mjEQ_JOINT && m_.eq_obj2id[e] >= 0;
      const int to = of_joints ? place_of(m_.eq_obj1id[e]) : -1;
      const int from = of_joints ? place_of(m_.eq_obj2id[e]) : -1;
      const bool active = m_.eq_active[e] != 0;
      if (of_joints && active && c[0] != 0.0)
        note(fmt::format("equality constraint {} keeps its joints {:g} apart: that is left out", e,
                         c[0]));
      const bool linear =
          active && from >= 0 && c[2] == 0.0 && c[3] == 0.0 && c[4] == 0.0 && to > from;
      if (linear)
        plant_.coupling[static_cast<std::size_t>(to)][static_cast<std::size_t>(from)] = c[1];
      else
        note(
            fmt::format("equality constraint {} is left out: a plant couples a joint to a multiple "
                        "of one before it",
                        e));
    }
  }

  void add_actuators() {
    std::vector<char> driven(links_.size(), 0);
    for (int a = 0; a < m_.nu; ++a) {
      const std::string name = actuator_name(a);
      const bool on_joint = m_.actuator_trntype[a] == mjTRN_JOINT;
      const bool fixed = m_.actuator_gaintype[a] == mjGAIN_FIXED;
      if (!on_joint || !fixed) {
        note(fmt::format("actuator {} is left out: it acts on no joint, or its gain varies", name));
        continue;
      }
      const auto j = static_cast<std::size_t>(place_of(m_.actuator_trnid[2 * a]));
      Joint& joint = plant_.joints[j];
      if (driven[j] != 0) {
        note(fmt::format("actuator {} is left out: joint {} has another one", name, joint.name));
        continue;
      }
      driven[j] = 1;
      const double gear = m_.actuator_gear[6 * static_cast<Index>(a)];
      const double gain = m_.actuator_gainprm[static_cast<Index>(a) * mjNGAIN];
      const mjtNum* bias = m_.actuator_biasprm + static_cast<Index>(a) * mjNBIAS;
      const double pushed = m_.actuator_biastype[a] == mjBIAS_AFFINE ? bias[0] : 0.0;
      if (m_.actuator_biastype[a] == mjBIAS_NONE ||
          (m_.actuator_biastype[a] == mjBIAS_AFFINE && bias[1] == 0.0 && bias[2] == 0.0)) {
        joint.drive.input = joint.kind == JointKind::kPrismatic ? "force_n" : "torque_n_m";
        joint.drive.gain = gain * gear;
      } else if (bias[1] != 0.0) {
        joint.controller = Controller{gain * gear * gear, 0.0 - bias[2] * gear * gear, 0.0, false};
      } else {
        note(fmt::format("actuator {} is left out: it follows a velocity", name));
      }
      const mjtNum* range = m_.actuator_forcerange + 2 * static_cast<Index>(a);
      if (m_.actuator_dyntype[a] != mjDYN_NONE)
        note(fmt::format("dyntype of actuator {} is left out: a plant's drive has no lag", name));
      if (m_.actuator_forcelimited[a] != 0 && range[0] - pushed != pushed - range[1])
        note(
            fmt::format("forcerange {:g} {:g} of actuator {} is taken by its upper end: a plant's "
                        "limit is the same to both sides",
                        range[0], range[1], name));
      if (m_.actuator_forcelimited[a] != 0 && range[1] > pushed)
        joint.effects.push_back(
            {"saturation", "", {{"limit", std::abs(gear) * (range[1] - pushed)}}});
      if (pushed != 0.0)
        joint.effects.push_back({"effort_offset", "", {{"offset", -gear * pushed}}});
    }
  }

  void add_words() {
    for (Joint& joint : plant_.joints) {
      const auto limit = words_.effort_limit.find(joint.name);
      if (limit != words_.effort_limit.end()) limit_effort(joint, limit->second);
      if (const auto speed = words_.speed_limit.find(joint.name); speed != words_.speed_limit.end())
        joint.limits.speed_ji = within(kSpeedRange, speed->second);
      const auto reduction = words_.reduction.find(joint.name);
      if (reduction != words_.reduction.end()) set_reduction(joint, reduction->second);
    }
    for (const ModelWords::Mimic& mimic : words_.mimics) {
      const auto to = plant_.joint_index(mimic.joint), from = plant_.joint_index(mimic.of);
      if (to && from && *from < *to)
        plant_.coupling[*to][*from] = mimic.ratio;
      else
        note(
            fmt::format("joint {} is left free, though it mimics {}: a plant couples a joint to a "
                        "multiple of one before it",
                        mimic.joint, mimic.of));
    }
  }

  /// An actuator may have the smaller limit.
  static void limit_effort(Joint& joint, double limit) {
    for (Effect& effect : joint.effects) {
      if (effect.id != "saturation") continue;
      double& own = effect.parameters.at("limit");
      own = std::min(own, limit);
      return;
    }
    joint.effects.push_back({"saturation", "", {{"limit", limit}}});
  }

  void note_rest() {
    if (m_.ntendon > 0) note(fmt::format("{} tendons are left out", m_.ntendon));
    if (m_.ngeom > 0) note("contacts are left out: a plant touches nothing");
    if (m_.opt.density != 0.0 || m_.opt.viscosity != 0.0)
      note("density and viscosity of the medium are left out: a plant moves in nothing");
  }

  const mjModel& m_;
  const ModelWords& words_;
  std::vector<RawLink> links_;
  Vector3d tool_ = Vector3d::Zero();  ///< of the last link, in its raw frame
  Plant plant_;
};

}  // namespace

core::Result<Plant> plant_of_model(const mjModel& model, const std::string& source,
                                   const ModelWords& words) {
  return Importer(model, source, words).plant();
}

}  // namespace ravencal::physics
