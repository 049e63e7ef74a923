// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/model_words.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using tinyxml2::XMLElement;

/// Below what any link weighs, above what the library takes for nothing.
constexpr const char* kNothing = "1e-14";

template <typename Visit>
void for_each(XMLElement& parent, const char* name, Visit visit) {
  for (XMLElement* e = parent.FirstChildElement(name); e != nullptr;
       e = e->NextSiblingElement(name))
    visit(*e);
}

/// What a macro processor would have replaced.
const XMLElement* unexpanded(const XMLElement& element) {
  if (std::string_view(element.Name()).starts_with("xacro:")) return &element;
  for (const tinyxml2::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
    const std::string_view value = a->Value();
    if (value.find("$(") != value.npos || value.find("${") != value.npos) return &element;
  }
  if (const char* text = element.GetText();
      text != nullptr && std::string_view(text).find("${") != std::string_view::npos)
    return &element;
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    if (const XMLElement* found = unexpanded(*e)) return found;
  return nullptr;
}

std::string attribute_of(const XMLElement* element, const char* attribute = "name") {
  const char* name = element != nullptr ? element->Attribute(attribute) : nullptr;
  return name != nullptr ? name : "";
}

core::Status check_roots(RobotDocument& document) {
  std::set<std::string> children;
  for_each(document.root(), "joint", [&](XMLElement& joint) {
    children.insert(attribute_of(joint.FirstChildElement("child"), "link"));
  });
  const XMLElement* first = nullptr;
  for (const XMLElement* link = document.root().FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    if (children.contains(attribute_of(link))) continue;
    if (first != nullptr)
      return error_at(*link, fmt::format("link '{}' hangs on no joint, and neither does '{}': a "
                                         "robot has one base",
                                         attribute_of(link), attribute_of(first)));
    first = link;
  }
  return {};
}

/// Numbers that a robot cannot have.
core::Status check_number(const XMLElement& element, const char* attribute, const std::string& of) {
  const double value = element.DoubleAttribute(attribute);
  if (value >= 0.0 && std::isfinite(value)) return {};
  return error_at(element, fmt::format("{} of {} is {}, below zero or no number", attribute, of,
                                       element.Attribute(attribute)));
}

constexpr const char* kJointTypes[] = {"revolute", "continuous", "prismatic",
                                       "fixed",    "floating",   "planar"};

core::Status take_joint(const XMLElement& joint, ModelWords& words,
                        std::vector<std::string>& notes) {
  const std::string name = attribute_of(&joint), type = attribute_of(&joint, "type");
  if (std::find(std::begin(kJointTypes), std::end(kJointTypes), type) == std::end(kJointTypes))
    return error_at(joint, fmt::format("joint '{}' is of type '{}'; URDF has {}", name, type,
                                       fmt::join(kJointTypes, ", ")));
  if (const XMLElement* dynamics = joint.FirstChildElement("dynamics"))
    for (const char* number : {"friction", "damping"})
      RAVENCAL_RETURN_IF_ERROR(check_number(*dynamics, number, fmt::format("joint '{}'", name)));
  if (const XMLElement* limit = joint.FirstChildElement("limit")) {
    RAVENCAL_RETURN_IF_ERROR(check_number(*limit, "effort", fmt::format("joint '{}'", name)));
    if (const double effort = limit->DoubleAttribute("effort"); effort > 0.0)
      words.effort_limit[name] = effort;
    if (const double speed = limit->DoubleAttribute("velocity"); speed > 0.0)
      words.speed_limit[name] = speed;
  }
  if (const XMLElement* mimic = joint.FirstChildElement("mimic")) {
    words.mimics.push_back(
        {name, attribute_of(mimic, "joint"), mimic->DoubleAttribute("multiplier", 1.0)});
    if (mimic->DoubleAttribute("offset") != 0.0)
      notes.push_back(fmt::format("{}: offset {} of joint {} to {} is left out",
                                  RobotDocument::where(*mimic), mimic->Attribute("offset"), name,
                                  attribute_of(mimic, "joint")));
  }
  return {};
}

/// Joints and links stand in the robot itself.
core::Status check_places(const XMLElement& around, bool is_root) {
  for (const XMLElement* e = around.FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    const bool is_part = (is_named(*e, "joint") && e->FirstChildElement("child") != nullptr) ||
                         (is_named(*e, "link") && e->FirstChildElement("inertial") != nullptr);
    if (is_part && !is_root)
      return error_at(*e, fmt::format("<{}> stands in <{}> and not in the robot itself", e->Name(),
                                      around.Name()));
    if (!is_named(*e, "gazebo")) RAVENCAL_RETURN_IF_ERROR(check_places(*e, false));
  }
  return {};
}

core::Status check_masses(const RobotDocument& document) {
  for (const XMLElement* link = document.root().FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link"))
    if (const XMLElement* inertial = link->FirstChildElement("inertial"))
      if (const XMLElement* mass = inertial->FirstChildElement("mass"))
        RAVENCAL_RETURN_IF_ERROR(
            check_number(*mass, "value", fmt::format("link '{}'", attribute_of(link))));
  return {};
}

void take_reductions(RobotDocument& document, ModelWords& words, std::vector<std::string>& notes) {
  for_each(document.root(), "transmission", [&](XMLElement& transmission) {
    const XMLElement* joint = transmission.FirstChildElement("joint");
    if (joint == nullptr) return;
    const bool joins = joint->NextSiblingElement("joint") != nullptr;
    const XMLElement* actuator = transmission.FirstChildElement("actuator");
    for (const XMLElement* at : {actuator, joint, static_cast<const XMLElement*>(&transmission)}) {
      const XMLElement* ratio =
          at != nullptr ? at->FirstChildElement("mechanicalReduction") : nullptr;
      const double value = ratio != nullptr ? std::abs(ratio->DoubleText()) : 0.0;
      if (!(value > 0.0)) continue;
      if (joins)
        notes.push_back(fmt::format("{}: a reduction that several joints share is left out",
                                    RobotDocument::where(*ratio)));
      else
        words.reduction[attribute_of(joint)] = value;
      return;
    }
  });
}

/// Links stay bodies of their own, so that each can get its inertia back.
void ready_for_library(RobotDocument& document) {
  XMLElement& compiler =
      child_of(document, child_of(document, document.root(), "mujoco"), "compiler");
  compiler.SetAttribute("fusestatic", "false");
  compiler.SetAttribute("balanceinertia", "true");
  compiler.SetAttribute("boundmass", kNothing);
  compiler.SetAttribute("boundinertia", kNothing);
}

}  // namespace

core::Result<ModelWords> take_urdf_words(RobotDocument& document, std::vector<std::string>& notes) {
  if (const XMLElement* macro = unexpanded(document.root()))
    return error_at(*macro, fmt::format("<{}> is xacro that nobody expanded: `xacro FILE > "
                                        "robot.urdf` writes the robot",
                                        macro->Name()));
  RAVENCAL_RETURN_IF_ERROR(check_places(document.root(), true));
  RAVENCAL_RETURN_IF_ERROR(check_roots(document));
  RAVENCAL_RETURN_IF_ERROR(check_masses(document));
  ModelWords words;
  for (XMLElement* joint = document.root().FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint"))
    RAVENCAL_RETURN_IF_ERROR(take_joint(*joint, words, notes));
  take_reductions(document, words, notes);
  ready_for_library(document);
  return words;
}

void restore_urdf_inertias(const RobotDocument& document, mjModel& model,
                           std::vector<std::string>& notes) {
  std::vector<std::string> restored;
  for (const XMLElement* link = document.root().FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const XMLElement* inertial = link->FirstChildElement("inertial");
    const XMLElement* stated =
        inertial != nullptr ? inertial->FirstChildElement("inertia") : nullptr;
    const int body = mj_name2id(&model, mjOBJ_BODY, attribute_of(link).c_str());
    if (stated == nullptr || body < 0) continue;
    const auto part = [&](const char* name) { return stated->DoubleAttribute(name); };
    Matrix3d about;
    about << part("ixx"), part("ixy"), part("ixz"), part("ixy"), part("iyy"), part("iyz"),
        part("ixz"), part("iyz"), part("izz");
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(about);
    const Vector3d moments = solver.eigenvalues();
    if (moments[0] + moments[1] >= moments[2]) continue;
    Matrix3d axes = solver.eigenvectors();
    if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
    const Quaterniond turn(urdf_pose(inertial->FirstChildElement("origin")).linear() * axes);
    const auto at = static_cast<Eigen::Index>(body);
    Eigen::Map<Vector3d>(model.body_inertia + 3 * at) = moments;
    Eigen::Map<Eigen::Vector4d>(model.body_iquat + 4 * at) << turn.w(), turn.x(), turn.y(),
        turn.z();
    restored.push_back(attribute_of(link) + (moments[0] < 0.0 ? " (one below zero: none)" : ""));
  }
  if (!restored.empty())
    notes.push_back(
        fmt::format("inertia of {}: no rigid body has it (its two smaller moments are "
                    "together below the greatest); taken as it is stated",
                    fmt::join(restored, ", ")));
}

}  // namespace ravencal::physics
