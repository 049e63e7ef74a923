// SPDX-License-Identifier: Apache-2.0
//
// Arguments of `ravencal robot`, the same in `ravencal` and in `ravencal-ros`.
#pragma once

#include <string>

#include "core/result.hpp"
#include "robot/robot_loop.hpp"
#include "robot/virtual_controller.hpp"

namespace CLI {
class App;
}

namespace ravencal::robot {

struct RobotArguments {
  std::string plant;
  std::string arm;                ///< empty: the plant's
  std::string controller_branch;  ///< "main", "crtk"; empty: the plant's, else crtk
  std::string first_arm;          ///< "gold", "green"; empty: the branch's
  VirtualControllerOptions controller;
  RobotLoopOptions loop;
  bool pedal_down = false;
  bool no_encoders = false;
  double wait_s = 600.0;
  double duration_s = 0.0;  ///< 0: until Ctrl-C
};

void add_robot_arguments(CLI::App& command, RobotArguments& arguments);

/// `plant` becomes the robot's, with its branch. Errors: the plant, the plugin or its weights
/// cannot be loaded.
core::Result<VirtualController> make_virtual_controller(const RobotArguments& arguments,
                                                        physics::Plant& plant);

}  // namespace ravencal::robot
