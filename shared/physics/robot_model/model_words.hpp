// SPDX-License-Identifier: Apache-2.0
//
// What a robot model says in words that the installed libmujoco does not know or does not ask for.
// They are taken out of the document before it is compiled.
#pragma once

#include <mujoco/mujoco.h>

#include <map>
#include <string>
#include <vector>

#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {

/// What a plant takes beside the compiled model; joints by name.
struct ModelWords {
  struct Mimic {
    std::string joint, of;
    double ratio = 1.0;
  };
  std::map<std::string, double, std::less<>> effort_limit;  ///< N m or N at the joint
  std::map<std::string, double, std::less<>> speed_limit;   ///< rad/s or m/s of the joint
  std::map<std::string, double, std::less<>> reduction;     ///< motor rad per joint rad
  std::vector<Mimic> mimics;
};

/// Of servos in MJCF: damping, which older versions have no word for.
class ServoWords {
 public:
  /// Takes kv, dampratio, timeconst and inheritrange from position actuators and their classes.
  static ServoWords take(RobotDocument& document, std::vector<std::string>& notes);
  /// Into the compiled model, whose actuators are those of the document.
  void apply(mjModel& model) const;

 private:
  struct Servo {
    double kv = 0.0, dampratio = 0.0;
  };
  std::vector<Servo> servos_;
};

/// Of the effort at joints of an MJCF document (actuatorfrcrange).
class EffortLimits {
 public:
  static EffortLimits take(RobotDocument& document, std::vector<std::string>& notes);
  /// By name, N m or N. Of joints without a name only where the library made none beside the
  /// document's.
  [[nodiscard]] std::map<std::string, double, std::less<>> of(const mjModel& model) const;

 private:
  struct Limit {
    std::string joint;
    double effort = 0.0;
  };
  std::vector<Limit> limits_;  ///< by place in tree_of; 0: none
};

/// A URDF document's efforts, mimics and reductions; readies it for the library, which refuses
/// inertias that no rigid body has and fuses links. Errors (kData, with the place): xacro that
/// nobody expanded, several roots, a friction or damping below zero.
core::Result<ModelWords> take_urdf_words(RobotDocument& document, std::vector<std::string>& notes);

/// Moments of inertia as a URDF states them, where the library took others.
void restore_urdf_inertias(const RobotDocument& document, mjModel& model,
                           std::vector<std::string>& notes);

}  // namespace ravencal::physics
