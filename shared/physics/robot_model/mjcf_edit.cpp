// SPDX-License-Identifier: Apache-2.0
//
// Joints, actuators, equalities and keyframes of an MJCF document.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "physics/plant_effort.hpp"
#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

using tinyxml2::XMLElement;

/// Of the time step: the stiffest stop that the library's solver takes.
constexpr double kStopTimeConstant = 2.0;
/// Impedance of a stop: that of the library's own joints. Beyond, it rings at this time constant.
constexpr double kStopImpedance = 0.95;
/// Of the inertia of drive and link: what moves between a gap and a spring behind it. No plant has
/// it.
constexpr double kBetweenShare = 0.05;

/// The degrees that the library reads as just this angle, where there are any.
double degrees(double angle_rad) {
  constexpr double kRadPerDegree = std::numbers::pi / 180.0;
  const double near = angle_rad / kRadPerDegree;
  for (const double beside : {near, std::nextafter(near, 0.0), std::nextafter(near, 1e9)})
    if (beside * kRadPerDegree == angle_rad) return beside;
  return near;
}

struct AddedJoint {
  int position = 0, velocity = 0;  ///< places before which the document's states get a zero
};

class MjcfJoints {
 public:
  MjcfJoints(ModelEdit& edit, const Tree& tree)
      : edit_(edit),
        tree_(tree),
        in_degrees_(compiler_word(edit.document, "angle", "degree") != "radian") {}

  void edit() {
    const std::vector<int> joints = plant_joints(edit_.model);
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const JointNumbers given = joint_numbers(edit_.given.joints[j]);
      const JointNumbers wanted = joint_numbers(edit_.wanted.joints[j]);
      const std::string name = edit_.given.joints[j].name;
      XMLElement& element = *tree_.joints[static_cast<std::size_t>(joints[j])];
      // What stands behind it and the callback find a joint by its name.
      if (!(edit_.given.joints[j] == edit_.wanted.joints[j]))
        element.SetAttribute("name", name.c_str());
      const auto write = [&](const char* attribute, double before, double after) {
        if (before != after) edit_.set(element, attribute, numbers_text(after), name);
      };
      write("frictionloss", given.frictionloss, wanted.frictionloss);
      write("damping", given.damping, wanted.damping);
      write("armature", given.armature, wanted.armature);
      add_series(joints[j], name, given, wanted);
    }
    lengthen_keyframes();
  }

 private:
  [[nodiscard]] XMLElement* existing(int of, SeriesKind kind) const {
    for (int j = of + 1; j < edit_.model.njnt; ++j) {
      const std::optional<SeriesJoint> series = series_joint(edit_.model, j);
      if (series && series->of == of && series->kind == kind)
        return tree_.joints[static_cast<std::size_t>(j)];
    }
    return nullptr;
  }

  void add_series(int joint, const std::string& name, const JointNumbers& given,
                  const JointNumbers& wanted) {
    XMLElement* last = tree_.joints[static_cast<std::size_t>(joint)];
    const auto place = [&](SeriesKind kind, bool differs) -> XMLElement* {
      XMLElement* element = existing(joint, kind);
      if (element == nullptr && differs) element = add_joint(joint, *last, name, kind);
      if (element != nullptr) last = element;
      return differs ? element : nullptr;
    };
    const bool other_spring =
        given.stiffness != wanted.stiffness || given.cable_damping != wanted.cable_damping;
    const bool other_gap = given.half_width != wanted.half_width ||
                           (wanted.half_width > 0.0 && given.stiffness != wanted.stiffness);
    const bool is_turned = edit_.model.jnt_type[joint] == mjJNT_HINGE;
    if (XMLElement* gap = place(SeriesKind::kBacklash, other_gap)) {
      const double reach =
          is_turned && in_degrees_ ? degrees(wanted.half_width) : wanted.half_width;
      edit_.set(*gap, "range", numbers_text(-reach, reach), gap->Attribute("name"));
      if (wanted.stiffness > 0.0) write_between(*gap, joint, wanted);
    }
    if (XMLElement* cable = place(SeriesKind::kCable, other_spring)) {
      edit_.set(*cable, "stiffness", numbers_text(wanted.stiffness), cable->Attribute("name"));
      edit_.set(*cable, "damping", numbers_text(wanted.cable_damping), cable->Attribute("name"));
    }
  }

  /// An inertia that resists the motion of this joint alone: without one, what lies between stop
  /// and spring has no motion of its own. The time step resolves the spring.
  void write_between(XMLElement& series, int joint, const JointNumbers& wanted) {
    const double step_s = edit_.model.opt.timestep;
    const double least = std::max(kBetweenShare * edit_.model.dof_M0[edit_.model.jnt_dofadr[joint]],
                                  wanted.stiffness * step_s * step_s);
    edit_.set(series, "armature", numbers_text(least), series.Attribute("name"));
  }

  /// States all that a class of defaults might say otherwise.
  XMLElement* add_joint(int of, XMLElement& after, const std::string& name, SeriesKind kind) {
    const mjModel& m = edit_.model;
    XMLElement* e = edit_.document.xml.NewElement("joint");
    const auto vector = [&](const mjtNum* values) {
      const mjtNum* v = values + 3 * static_cast<std::ptrdiff_t>(of);
      return numbers_text(v[0], v[1], v[2]);
    };
    e->SetAttribute("name", series_name(name, kind).c_str());
    e->SetAttribute("type", m.jnt_type[of] == mjJNT_HINGE ? "hinge" : "slide");
    e->SetAttribute("pos", vector(m.jnt_pos).c_str());
    e->SetAttribute("axis", vector(m.jnt_axis).c_str());
    for (const char* none : {"armature", "damping", "frictionloss", "stiffness", "margin"})
      e->SetAttribute(none, "0");
    e->SetAttribute("limited", kind == SeriesKind::kBacklash ? "true" : "false");
    if (kind == SeriesKind::kBacklash) {
      e->SetAttribute("solreflimit", numbers_text(kStopTimeConstant * m.opt.timestep, 1.0).c_str());
      e->SetAttribute("solimplimit", numbers_text(kStopImpedance, kStopImpedance, 0.001).c_str());
    }
    after.Parent()->InsertAfterChild(&after, e);
    added_.push_back({m.jnt_qposadr[of] + 1, m.jnt_dofadr[of] + 1});
    return e;
  }

  /// States that the document names have a number for each joint.
  void lengthen_keyframes() {
    std::reverse(added_.begin(), added_.end());
    for (XMLElement* key : children_of_sections(edit_.document, "keyframe")) {
      lengthen(*key, "qpos", &AddedJoint::position);
      lengthen(*key, "qvel", &AddedJoint::velocity);
    }
  }

  void lengthen(XMLElement& key, const char* attribute, int AddedJoint::*place) {
    const char* text = key.Attribute(attribute);
    if (text == nullptr || added_.empty()) return;
    std::istringstream stream(text);
    std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
    for (const AddedJoint& joint : added_)
      if (joint.*place <= static_cast<int>(words.size()))
        words.insert(words.begin() + joint.*place, "0");
    edit_.set(key, attribute, fmt::format("{}", fmt::join(words, " ")), "keyframe");
  }

  ModelEdit& edit_;
  const Tree& tree_;
  bool in_degrees_;
  std::vector<AddedJoint> added_;
};

/// The general actuator that any shortcut stands for, with these numbers.
void make_general(ModelEdit& edit, XMLElement& element, double gain,
                  const std::array<double, 3>& bias, const std::string& name) {
  if (!is_named(element, "general")) {
    for (const char* shortcut : {"kp", "kv", "dampratio", "timeconst", "inheritrange"})
      element.DeleteAttribute(shortcut);
    edit.changed.push_back(fmt::format("{}: actuator <{}> -> <general>", name, element.Name()));
    element.SetName("general");
    element.SetAttribute("dyntype", "none");
  }
  element.SetAttribute("gaintype", "fixed");
  element.SetAttribute("biastype", "affine");
  edit.set(element, "gainprm", numbers_text(gain), name);
  edit.set(element, "biasprm", numbers_text(bias[0], bias[1], bias[2]), name);
}

/// A gear may have six numbers, of which a joint takes the first.
std::string with_first(const char* given, double first) {
  std::istringstream stream(given != nullptr ? given : "");
  std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
  words.resize(std::max<std::size_t>(1, words.size()));
  words[0] = numbers_text(first);
  return fmt::format("{}", fmt::join(words, " "));
}

void edit_actuator(ModelEdit& edit, std::size_t j, int actuator, XMLElement& element) {
  const ActuatorNumbers given = actuator_numbers(edit.given.joints[j]);
  const ActuatorNumbers wanted = actuator_numbers(edit.wanted.joints[j]);
  if (given == wanted) return;
  const mjModel& m = edit.model;
  const std::string& name = edit.given.joints[j].name;
  const auto a = static_cast<std::ptrdiff_t>(actuator);
  const double gear = m.actuator_gear[6 * a];
  const double gain = m.actuator_gainprm[mjNGAIN * a];
  const mjtNum* bias = m.actuator_biasprm + mjNBIAS * a;
  const double scale = wanted.scale / given.scale;
  const bool servo = m.actuator_biastype[actuator] == mjBIAS_AFFINE && bias[1] != 0.0;
  // A motor's gear scales its force behind the limit; a servo's gear would scale its position too.
  const double own_scale = servo ? scale : 1.0;
  const double pushed = 0.0 - own_scale * wanted.offset / gear;
  if (!servo) {
    if (scale != 1.0)
      edit.set(element, "gear", with_first(element.Attribute("gear"), scale * gear), name);
    if (wanted.offset != given.offset) make_general(edit, element, gain, {pushed, 0.0, 0.0}, name);
  } else {
    const double stiffer = wanted.kp == given.kp ? scale : scale * wanted.kp / given.kp;
    const double rate =
        wanted.kd == given.kd ? scale * bias[2] : -scale * wanted.kd / (gear * gear);
    if (is_named(element, "position") && rate == bias[2] && wanted.offset == given.offset) {
      if (stiffer != 1.0) edit.set(element, "kp", numbers_text(stiffer * gain), name);
    } else {
      make_general(edit, element, stiffer * gain, {pushed, stiffer * bias[1], rate}, name);
    }
  }
  const bool same_range =
      wanted.limit == given.limit && wanted.offset == given.offset && own_scale == 1.0;
  if (same_range || (wanted.limit <= 0.0 && given.limit <= 0.0)) return;
  edit.set(element, "forcelimited", wanted.limit > 0.0 ? "true" : "false", name);
  const double half = own_scale * wanted.limit / std::abs(gear);
  if (wanted.limit > 0.0)
    edit.set(element, "forcerange", numbers_text(pushed - half, pushed + half), name);
}

core::Status edit_couplings(ModelEdit& edit) {
  const mjModel& m = edit.model;
  const std::vector<XMLElement*> elements = children_of_sections(edit.document, "equality");
  const std::vector<int> joints = plant_joints(m);
  for (int e = 0; e < m.neq; ++e) {
    if (m.eq_type[e] != mjEQ_JOINT || m.eq_obj2id[e] < 0) continue;
    const auto to = edit.given.joint_index(joint_name(m, m.eq_obj1id[e]));
    const auto from = edit.given.joint_index(joint_name(m, m.eq_obj2id[e]));
    if (!to || !from || edit.given.coupling[*to][*from] == 0.0) continue;
    const double wanted = coupling_of(edit.wanted, *to, *from);
    if (wanted == coupling_of(edit.given, *to, *from)) continue;
    if (elements.size() != static_cast<std::size_t>(m.neq))
      return core::data_error(
          fmt::format("has {} equalities, of which MuJoCo reads {}", elements.size(), m.neq));
    const mjtNum* c = m.eq_data + static_cast<std::ptrdiff_t>(e) * mjNEQDATA;
    edit.set(*elements[static_cast<std::size_t>(e)], "polycoef",
             numbers_text(c[0], wanted, 0.0, 0.0, 0.0), edit.given.joints[*to].name);
  }
  return {};
}

}  // namespace

XMLElement* actuator_of(RobotDocument& document, const mjModel& m, int joint) {
  const std::vector<XMLElement*> elements = children_of_sections(document, "actuator");
  for (int a = 0; a < m.nu && elements.size() == static_cast<std::size_t>(m.nu); ++a) {
    if (m.actuator_trntype[a] != mjTRN_JOINT || m.actuator_trnid[2 * a] != joint ||
        m.actuator_gaintype[a] != mjGAIN_FIXED)
      continue;
    XMLElement* element = elements[static_cast<std::size_t>(a)];
    const bool known = is_named(*element, "motor") || is_named(*element, "position") ||
                       is_named(*element, "general");
    return known ? element : nullptr;
  }
  return nullptr;
}

core::Status edit_mjcf(ModelEdit& edit) {
  const Tree tree = tree_of(edit.document);
  const mjModel& m = edit.model;
  if (tree.joints.size() != static_cast<std::size_t>(m.njnt) ||
      tree.bodies.size() != static_cast<std::size_t>(m.nbody))
    return core::data_error(
        fmt::format("has {} joints on {} bodies, of which MuJoCo {} reads {} on {}: write the "
                    "model out by mj_saveLastXML first",
                    tree.joints.size(), tree.bodies.size(), mj_versionString(), m.njnt, m.nbody));
  const std::vector<XMLElement*> actuators = children_of_sections(edit.document, "actuator");
  const std::vector<int> joints = plant_joints(m);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    XMLElement* element = actuator_of(edit.document, m, joints[j]);
    const auto place = std::find(actuators.begin(), actuators.end(), element);
    if (element != nullptr)
      edit_actuator(edit, j, static_cast<int>(place - actuators.begin()), *element);
  }
  RAVENCAL_RETURN_IF_ERROR(edit_couplings(edit));
  edit_mjcf_frames(edit, tree);
  edit_mjcf_links(edit, tree);
  MjcfJoints(edit, tree).edit();
  return {};
}

}  // namespace ravencal::physics
