// SPDX-License-Identifier: Apache-2.0
//
// Where the joints of a robot model stand, as a plant states it.
#include <algorithm>
#include <cmath>

#include "physics/robot_model/body_places.hpp"
#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using tinyxml2::XMLElement;

/// A joint that stands elsewhere, and by how much its body's place changes: place = parent * change
/// * what the model says, in the frame of the body's parent.
struct MovedJoint {
  std::size_t joint = 0;
  int body = 0;
  Isometry3d body_to_wanted{Isometry3d::Identity()};  ///< in the body's own frame, joints at zero
  Isometry3d in_parent{Isometry3d::Identity()};       ///< in its parent's frame, joints at zero
};

std::vector<MovedJoint> moved_joints(const ModelEdit& edit) {
  std::vector<MovedJoint> out;
  const std::vector<int> joints = plant_joints(edit.model);
  const std::vector<Isometry3d> links = link_frames(edit.given);
  const std::vector<Isometry3d> bodies = body_frames(edit.model);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Frame& wanted = *edit.wanted.joints[j].frame;
    if (same_frame(*edit.given.joints[j].frame, wanted)) continue;
    const auto carrier = edit.given.joint_index(wanted.carried_by);
    const Isometry3d world = carrier ? links[*carrier] : Isometry3d::Identity();
    const int body = edit.model.jnt_bodyid[joints[j]];
    const Isometry3d& at = bodies[static_cast<std::size_t>(body)];
    const Isometry3d& parent = bodies[static_cast<std::size_t>(edit.model.body_parentid[body])];
    const Isometry3d moved = world * pose_of(wanted) * links[j].inverse() * at;
    out.push_back(
        {j, body, at.inverse() * moved, parent.inverse() * moved * at.inverse() * parent});
  }
  return out;
}

std::string moves(const ModelEdit& edit, const MovedJoint& moved) {
  return fmt::format("{}: stands {:.6g} m and {:.6g} rad from where it stood",
                     edit.given.joints[moved.joint].name, moved.body_to_wanted.translation().norm(),
                     Eigen::AngleAxisd(moved.body_to_wanted.linear()).angle());
}

/// Angles of URDF: about x, then y, then z of the parent.
Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  const double pitch = std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
  return {std::atan2(r(2, 1), r(2, 2)), pitch, std::atan2(r(1, 0), r(0, 0))};
}

Vector3d numbers_of(const XMLElement& element, const char* attribute) {
  Vector3d out = Vector3d::Zero();
  const char* text = element.Attribute(attribute);
  if (text != nullptr) std::sscanf(text, "%lf %lf %lf", &out[0], &out[1], &out[2]);
  return out;
}

}  // namespace

Isometry3d urdf_pose(const XMLElement* origin) {
  if (origin == nullptr) return Isometry3d::Identity();
  const Vector3d rpy = numbers_of(*origin, "rpy");
  return Eigen::Translation3d(numbers_of(*origin, "xyz")) *
         Eigen::AngleAxisd(rpy[2], Vector3d::UnitZ()) *
         Eigen::AngleAxisd(rpy[1], Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy[0], Vector3d::UnitX());
}

bool first_on_its_body(const mjModel& model, int joint) {
  return model.body_jntadr[model.jnt_bodyid[joint]] == joint;
}

void edit_mjcf_frames(ModelEdit& edit, const Tree& tree) {
  const std::vector<int> joints = plant_joints(edit.model);
  for (const MovedJoint& moved : moved_joints(edit)) {
    if (!first_on_its_body(edit.model, joints[moved.joint])) continue;
    XMLElement& body = *tree.bodies[static_cast<std::size_t>(moved.body)];
    const mjtNum* at = edit.model.body_pos + 3 * static_cast<Eigen::Index>(moved.body);
    const mjtNum* q = edit.model.body_quat + 4 * static_cast<Eigen::Index>(moved.body);
    const Isometry3d given =
        Eigen::Translation3d(at[0], at[1], at[2]) * Quaterniond(q[0], q[1], q[2], q[3]);
    const Isometry3d wanted = moved.in_parent * given;
    body.SetAttribute("pos", text_of(wanted.translation()).c_str());
    if (!wanted.linear().isApprox(given.linear(), kSameNumber)) {
      for (const char* other : {"axisangle", "xyaxes", "zaxis", "euler"})
        body.DeleteAttribute(other);
      const Quaterniond turn(wanted.linear());
      body.SetAttribute("quat", numbers_text(turn.w(), turn.x(), turn.y(), turn.z()).c_str());
    }
    edit.changed.push_back(moves(edit, moved));
  }
}

core::Status edit_urdf_frames(ModelEdit& edit) {
  for (const MovedJoint& moved : moved_joints(edit)) {
    const std::string& name = edit.given.joints[moved.joint].name;
    XMLElement* joint = urdf_joint(edit.document, name);
    if (joint == nullptr) return core::data_error(fmt::format("has no joint '{}'", name));
    XMLElement& origin = child_of(edit.document, *joint, "origin");
    const Isometry3d given = urdf_pose(&origin);
    const Isometry3d wanted = given * moved.body_to_wanted;
    origin.SetAttribute("xyz", text_of(wanted.translation()).c_str());
    if (!wanted.linear().isApprox(given.linear(), kSameNumber))
      origin.SetAttribute("rpy", text_of(roll_pitch_yaw(wanted.linear())).c_str());
    edit.changed.push_back(moves(edit, moved));
  }
  return {};
}

}  // namespace ravencal::physics
