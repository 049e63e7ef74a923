// SPDX-License-Identifier: Apache-2.0
//
// Changes of a robot model's document, listed as they are made.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "physics/plant.hpp"
#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {

struct ModelEdit {
  RobotDocument& document;
  const mjModel& model;  ///< of the document as it was
  const Plant& given;    ///< what that model is as a plant
  const Plant& wanted;
  std::vector<std::string> changed{};

  /// Writes an attribute and says so. `what`: whose it is.
  void set(tinyxml2::XMLElement& element, const char* attribute, const std::string& value,
           const std::string& what);
};

/// Shortest text that reads back to the same bits.
template <typename... Numbers>
std::string numbers_text(Numbers... values) {
  return fmt::format("{}", fmt::join({values...}, " "));
}

inline std::string text_of(const Eigen::Vector3d& v) { return numbers_text(v[0], v[1], v[2]); }

tinyxml2::XMLElement& child_of(RobotDocument& document, tinyxml2::XMLElement& parent,
                               const char* name);

/// What the joint's own element and those behind it state.
struct JointNumbers {
  double frictionloss = 0.0, damping = 0.0, armature = 0.0;
  double half_width = 0.0;                      ///< of a gap
  double stiffness = 0.0, cable_damping = 0.0;  ///< 0: nothing stretches

  [[nodiscard]] bool rigid() const { return half_width <= 0.0 && stiffness <= 0.0; }
};
JointNumbers joint_numbers(const Joint& joint);

/// What the joint's actuator states.
struct ActuatorNumbers {
  double scale = 1.0;   ///< effort given per effort asked
  double offset = 0.0;  ///< of the effort asked, moves nothing
  double limit = 0.0;   ///< of the effort asked; 0: none
  double kp = 0.0, kd = 0.0;

  bool operator==(const ActuatorNumbers&) const = default;
};
ActuatorNumbers actuator_numbers(const Joint& joint);

/// Changes all that MJCF can say. Errors (kData): the document has other parts than the library
/// compiled.
core::Status edit_mjcf(ModelEdit& edit);
core::Status edit_urdf(ModelEdit& edit);

/// Masses and inertias of MJCF bodies or URDF links, and the payload.
void edit_mjcf_links(ModelEdit& edit, const Tree& tree);
core::Status edit_urdf_links(ModelEdit& edit);

/// Where joints stand. Of an MJCF body with several joints only the first can be moved.
void edit_mjcf_frames(ModelEdit& edit, const Tree& tree);
core::Status edit_urdf_frames(ModelEdit& edit);
bool first_on_its_body(const mjModel& model, int joint);

/// The actuator that drives the joint and that can be changed: its element; null without one.
tinyxml2::XMLElement* actuator_of(RobotDocument& document, const mjModel& model, int joint);

/// URDF: the pose that an `origin` states; none is no change.
Eigen::Isometry3d urdf_pose(const tinyxml2::XMLElement* origin);
/// URDF: the joint's element; null without one.
tinyxml2::XMLElement* urdf_joint(RobotDocument& document, std::string_view name);

}  // namespace ravencal::physics
