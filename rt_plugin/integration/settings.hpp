// SPDX-License-Identifier: Apache-2.0
//
// What the adapter has to be told about its controller. C++98, no libraries.
#ifndef RAVENCAL_SETTINGS_HPP
#define RAVENCAL_SETTINGS_HPP

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "arms.hpp"
#include "ravencal/plugin.h"

namespace ravencal {

// Limits of the controller's inverse kinematics, from its defines.h: a correction that would lead
// a joint beyond them would move it at the next press of the pedal.
struct JointLimits {
  float lowest_ji[RAVENCAL_JOINTS];  // SHOULDER_, ELBOW_, Z_INS_MIN_LIMIT: rad, rad, m
  float highest_ji[RAVENCAL_JOINTS];
  // Where they fail: insertion at the remote centre, -d4 of r2_kinematics.h, and Lw around it.
  float remote_centre_m;
  float remote_centre_radius_m;

  // False: `error` says what is missing or inverted.
  bool are_there(char* error, size_t error_bytes) const {
    for (int slot = 0; slot < RAVENCAL_JOINTS; ++slot) {
      if (lowest_ji[slot] < highest_ji[slot]) continue;
      snprintf(
          error, error_bytes,
          "limits of joint %d are missing or inverted: lowest %g, highest %g; the controller's "
          "defines.h has them",
          slot + 1, static_cast<double>(lowest_ji[slot]), static_cast<double>(highest_ji[slot]));
      return false;
    }
    if (remote_centre_radius_m > 0.0F) return true;
    snprintf(error, error_bytes,
             "limits.remote_centre_radius_m is missing: Lw of the controller's r2_kinematics.h");
    return false;
  }
};

struct ControllerSettings {
  // Everything absent, and a correction that is shown and not applied.
  ControllerSettings()
      : plugin(0),
        weights(0),
        telemetry(0),
        mechanisms(0),
        poses_as_published(0),
        step_budget_ns(0),
        mode(RAVENCAL_MODE_SHADOW),
        share(1.0F),
        joint_mask((1U << RAVENCAL_JOINTS) - 1U),
        resume_after_stop(0) {
    memset(max_correction_ji, 0, sizeof max_correction_ji);
    memset(&calibrated, 0, sizeof calibrated);
    memset(&other, 0, sizeof other);
    memset(&limits, 0, sizeof limits);
  }

  const char* plugin;      // path of libravencal_plugin.so
  const char* weights;     // path of the blob; null: none yet, see load
  const char* telemetry;   // name for `ravencal monitor`, like "/ravencal-left"; null: none
  ArmSettings calibrated;  // the arm with the external encoders
  ArmSettings other;
  int mechanisms;  // how many of robot_device::mech are in use: NUM_MECH or num_mechs
  // raven_state takes pose, desired pose, grasp, type and Jacobian of its slot i from mech[i],
  // whose order is that of the USB boards' names: on the CRTK branch slot 0 holds the poses of the
  // green arm beside the joints of the gold one. 1: the plugin sees these fields as they are
  // published, which is what a model was trained on. 0: each arm's own.
  int poses_as_published;
  JointLimits limits;       // of the calibrated arm
  unsigned step_budget_ns;  // longer steps are overruns; 0: the plugin's default, half a cycle
  int mode;                 // RAVENCAL_MODE_* after open
  float share;              // 0..1 of the correction is applied
  unsigned joint_mask;      // to these joints: bit 0 shoulder, 1 elbow, 2 insertion
  // Larger corrections are refused: rad, rad, m; 0: the plugin's default. What the training of the
  // weights saw bounds them as well.
  float max_correction_ji[RAVENCAL_JOINTS];
  // 1: after an emergency stop the correction comes back. 0: it is shown and not applied, until
  // enable(1).
  int resume_after_stop;
};

}  // namespace ravencal

#endif  // RAVENCAL_SETTINGS_HPP
