// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/model_edit.hpp"

#include "physics/servo_law.hpp"

namespace ravencal::physics {

using tinyxml2::XMLElement;

void ModelEdit::set(XMLElement& element, const char* attribute, const std::string& value,
                    const std::string& what) {
  const char* before = element.Attribute(attribute);
  changed.push_back(fmt::format("{}: {} {} -> {}", what, attribute,
                                before != nullptr ? before : "(not at the element)", value));
  element.SetAttribute(attribute, value.c_str());
}

XMLElement& child_of(RobotDocument& document, XMLElement& parent, const char* name) {
  if (XMLElement* child = parent.FirstChildElement(name)) return *child;
  return *parent.InsertEndChild(document.xml.NewElement(name))->ToElement();
}

JointNumbers joint_numbers(const Joint& joint) {
  JointNumbers n;
  n.half_width = joint.parameter("backlash", "half_width");
  n.stiffness = joint.parameter("compliance", "stiffness");
  n.cable_damping = n.stiffness > 0.0 ? joint.parameter("compliance", "damping") : 0.0;
  n.frictionloss = joint.parameter("coulomb_friction", "level");
  if (n.rigid()) n.frictionloss += joint.parameter("joint_friction", "level");
  n.damping = joint.parameter("viscous_friction", "damping");
  n.armature = joint.motor_inertia_kg_m2 * joint.reduction * joint.reduction;
  return n;
}

ActuatorNumbers actuator_numbers(const Joint& joint) {
  ActuatorNumbers n;
  n.scale = 1.0 + joint.parameter("torque_constant", "ratio");
  n.offset = joint.parameter("effort_offset", "offset");
  n.limit = joint.parameter("saturation", "limit");
  if (const std::optional<ServoLaw> law = servo_law(joint)) {
    n.kp = law->position;
    n.kd = law->rate;
  }
  return n;
}

}  // namespace ravencal::physics
