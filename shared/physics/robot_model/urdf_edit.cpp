// SPDX-License-Identifier: Apache-2.0
//
// Joints of a URDF document.
#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {

using tinyxml2::XMLElement;

XMLElement* urdf_joint(RobotDocument& document, std::string_view name) {
  for (XMLElement* e = document.root().FirstChildElement("joint"); e != nullptr;
       e = e->NextSiblingElement("joint"))
    if (e->Attribute("name") != nullptr && e->Attribute("name") == name) return e;
  return nullptr;
}

core::Status edit_urdf(ModelEdit& edit) {
  for (std::size_t j = 0; j < edit.given.joints.size(); ++j) {
    const std::string& name = edit.given.joints[j].name;
    XMLElement* joint = urdf_joint(edit.document, name);
    if (joint == nullptr) return core::data_error(fmt::format("has no joint '{}'", name));
    const JointNumbers given = joint_numbers(edit.given.joints[j]);
    const JointNumbers wanted = joint_numbers(edit.wanted.joints[j]);
    const auto write = [&](const char* attribute, double before, double after) {
      if (before != after)
        edit.set(child_of(edit.document, *joint, "dynamics"), attribute, numbers_text(after), name);
    };
    write("friction", given.frictionloss, wanted.frictionloss);
    write("damping", given.damping, wanted.damping);
  }
  RAVENCAL_RETURN_IF_ERROR(edit_urdf_frames(edit));
  return edit_urdf_links(edit);
}

}  // namespace ravencal::physics
