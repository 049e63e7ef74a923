// SPDX-License-Identifier: Apache-2.0
//
// What the look-alike controller publishes. C++98.
#pragma once

#include <string.h>

#include "unit/integration_kinematics.hpp"

namespace LOOKALIKE {

// raven_state in its own units and with its own mixture of arms, in the catalogue's order: see
// shared/core/catalogue.hpp. Written after the message's field table, not after the adapter.
inline void publish(robot_device& device, const param_pass& params, long cycle_number, int sublevel,
                    double (&m)[240]) {
  const double deg = 180.0 / kPi;
  memset(m, 0, sizeof m);
  m[0] = static_cast<double>(cycle_number) * 1e-3;
  m[17] = params.runlevel;
  m[18] = sublevel;
  m[19] = params.last_sequence;
  for (int slot = 0; slot < 2; ++slot) {
    mechanism& mech = device.mech[slot];  // by slot, whichever arm that is
    m[20 + slot] = mech.type;
    m[22 + 3 * slot] = mech.pos.x;
    m[23 + 3 * slot] = mech.pos.y;
    m[24 + 3 * slot] = mech.pos.z;
    m[64 + 3 * slot] = mech.pos_d.x;
    m[65 + 3 * slot] = mech.pos_d.y;
    m[66 + 3 * slot] = mech.pos_d.z;
    for (int i = 0; i < 9; ++i) {
      m[28 + 9 * slot + i] = static_cast<double>(mech.ori.R[i / 3][i % 3]);
      m[46 + 9 * slot + i] = static_cast<double>(mech.ori_d.R[i / 3][i % 3]);
    }
    m[198 + slot] = mech.ori_d.grasp / 1000.0;
    for (int i = 0; i < 6; ++i) {
      m[216 + 6 * slot + i] = static_cast<double>(mech.r2_jac.velocity[i]);
      m[228 + 6 * slot + i] = static_cast<double>(mech.r2_jac.velocity[i]);
    }
    for (int j = 0; j < 8; ++j) {
      const DOF& joint = mech.joint[j];
      const int type = joint.type;  // gold 0 to 7, green 8 to 15
      m[1 + type] = static_cast<double>(joint.jpos) * deg;
      m[70 + type] = joint.enc_val;
      m[86 + type] = joint.current_cmd;
      m[102 + type] = static_cast<double>(joint.tau_d);
      m[118 + type] = static_cast<double>(joint.mpos) * deg;
      m[134 + type] = static_cast<double>(joint.mvel) * deg;
      m[150 + type] = static_cast<double>(joint.jvel) * deg;
      m[166 + type] = static_cast<double>(joint.mpos_d) * deg;
      m[182 + type] = static_cast<double>(joint.jpos_d) * deg;
      m[200 + type] = joint.enc_offset;
    }
  }
}

}  // namespace LOOKALIKE
