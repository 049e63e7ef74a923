// SPDX-License-Identifier: Apache-2.0
//
// The traits in which the published branches of the RAVEN-II's control program (uw-biorobotics/
// raven2: master d2307c5, here `main`; branch crtk 0d10caf) differ from each other and from an
// idealised controller. Code that differs between branches asks for a trait, never for the name.
// Files below are those of src/raven.
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace ravencal::physics {

/// Default: an idealised controller, which is neither branch: what a plant without the key
/// `controller` gets.
struct ControllerBranch {
  std::string_view name{};  ///< as in a plant's `controller`; empty: the idealised controller

  // Servo and homing.
  /// Adds the links' weight to the torque of every joint from pedal up on, whatever the control
  /// mode (rt_raven.cpp, raven_cartesian_space_command), but not while it homes (homing.cpp).
  bool adds_gravity_torque = false;
  /// A joint that has met its stop while homing stays under PD where it met it, until all have
  /// (homing.cpp, stop_trajectory); else its torque is zero.
  bool holds_at_stops = false;
  double home_time_s = 2.5;  ///< from the stops to the home pose (homing.cpp, start_trajectory)
  /// jvel has the cable coupling, and the tool's joints have one (fwd_cable_coupling.cpp); else
  /// jvel is the motor's velocity over the reduction.
  bool couples_velocities = false;
  /// The USB boards are read before the cycle's sleep (rt_process_preempt.cpp): encoder counts are
  /// one control cycle old when the controller uses them.
  bool reads_encoders_before_sleep = false;

  // What it publishes and how it takes commands.
  /// mech[0] is the green arm: board files are sorted by name, descending (USB_init.cpp), so that
  /// the boards' serial numbers decide; here with the serial numbers in the branch's defines.h.
  bool green_arm_first = false;
  /// `type` of the gold and of the green arm in raven_state (defines.h).
  std::array<int, 2> arm_types = {49, 22};
  int sublevel_when_homed = 0;  ///< of raven_state: SL_AUTO_INIT (main) or robot_ready() (crtk)
  /// After so many cycles without a joint command for either arm, the desired joints of both become
  /// the joints measured at the last one (rt_raven.cpp, joint_ctrl_countdown); 0: never.
  int cycles_to_reseed = 0;

  bool operator==(const ControllerBranch&) const = default;
};

/// The branch of this name; nullptr if there is none.
const ControllerBranch* find_controller_branch(std::string_view name);

/// Names of the branches for messages and options: "main, crtk".
std::string controller_branch_names();

}  // namespace ravencal::physics
