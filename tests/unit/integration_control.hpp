// SPDX-License-Identifier: Apache-2.0
//
// What the look-alike controller does with its desired joints and poses, and when it does not: run
// levels, homing, commands, inverse kinematics that fail, saturate and skip later arms. The
// conditions are those of the controller (ABI.md lists them with file and line); the code is ours.
// RAVENCAL_CRTK: the CRTK branch, else the main branch. C++98.
#pragma once

#include <math.h>

#include "unit/integration_inverse.hpp"
#include "unit/integration_structures.hpp"

namespace LOOKALIKE {

enum { kEStop = 0, kInitLevel = 1, kUp = 2, kDown = 3 };
enum control_mode { homing_mode, cartesian_mode };

const float kLowest[3] = {0.0F, 0.785398163F, 0.23F};
const float kHighest[3] = {1.570796327F, 2.356194490F, 0.56F};

// What the control laws keep from cycle to cycle.
struct control_state {
  control_mode mode;
  bool homing_wanted;  // taken over in E-stop
  bool initialized;
  int init_wait;
  int homing_cycles;
  int countdown;  // CRTK: cycles without joint commands until inverse kinematics run again
  int debounce;
};

// Commands that reach the control loop in one cycle.
struct commands {
  int pose_um[kMechanismRoom][3];  // added to pos_d
  bool has_pose[kMechanismRoom];   // pos_d is set
  int position_um[kMechanismRoom][3];
  bool joints[kMechanismRoom];  // CRTK: joint commands arrive for that arm
  float joint_ji[kMechanismRoom][3];
};

inline void desired_pose_to_actual(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    device.mech[i].pos_d = device.mech[i].pos;
    device.mech[i].ori_d = device.mech[i].ori;
  }
}

// The lowest of the boards' levels, after it has differed in four cycles.
inline void state_machine(control_state& c, param_pass& params, int level) {
  if (params.runlevel == level) return;
  if (c.debounce < 3) {
    ++c.debounce;
    return;
  }
  c.debounce = 0;
  params.runlevel = static_cast<u_08>(level);
  if (level != kEStop) return;
  c.initialized = false;
  params.sublevel = 0;
}

inline void take_commands(robot_device& device, const param_pass& params, const commands& from) {
#ifdef RAVENCAL_CRTK
  // Enabled in INIT, and from the request to press the pedal on, before the PLC has followed it.
  const bool enabled =
      params.runlevel == kInitLevel || (params.runlevel > kInitLevel && device.surgeon_mode != 0);
  bool any_joints = false;
  for (int i = 0; i < 2; ++i) {
    mechanism& m = device.mech[i];
    if (enabled && from.joints[i]) {
      any_joints = true;
      m.joint_control = true;
      for (int j = 0; j < 3; ++j) m.joint[j].jpos_d += from.joint_ji[i][j];
    }
    if (!any_joints) m.joint_control = false;
  }
#else
  const bool enabled = params.runlevel == kDown;
#endif
  for (int i = 0; i < kMechanisms && enabled; ++i) {
    if (from.has_pose[i]) {
      device.mech[i].pos_d.x = from.position_um[i][0];
      device.mech[i].pos_d.y = from.position_um[i][1];
      device.mech[i].pos_d.z = from.position_um[i][2];
    }
    device.mech[i].pos_d.x += from.pose_um[i][0];
    device.mech[i].pos_d.y += from.pose_um[i][1];
    device.mech[i].pos_d.z += from.pose_um[i][2];
  }
}

// Measured poses; desired ones follow them where neither INIT nor the pedal decides.
inline void forward_kinematics_of_all(robot_device& device, int level) {
  for (int i = 0; i < kMechanisms; ++i) {
    mechanism& m = device.mech[i];
    kinematics(m);
    m.ori.grasp = static_cast<int>((m.joint[7].jpos + m.joint[6].jpos) * 1000.0F);
  }
  if (level != kDown && level != kInitLevel) desired_pose_to_actual(device);
}

// With joints of the motors alone, past the hook.
inline void set_start_pose(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) forward_coupling(device.mech[i]);
  forward_kinematics_of_all(device, kInitLevel);
  desired_pose_to_actual(device);
}

// Types of the joints come with the first sublevel of INIT.
inline void set_joint_types(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    const int first = i == kGoldIndex ? 0 : i == kGreenIndex ? 8 : 16;
    for (int j = 0; j < 8; ++j) device.mech[i].joint[j].type = static_cast<u_16>(first + j);
  }
}

inline void initialize(robot_device& device, control_state& c, param_pass& params) {
  if (params.runlevel == kEStop) c.initialized = false;
  if (params.runlevel != kInitLevel) return;
  if (params.sublevel == 0) {
    params.sublevel = 1;
  } else if (params.sublevel == 1 && !c.initialized) {
    set_joint_types(device);
    set_start_pose(device);
    params.sublevel = 2;
  } else if (params.sublevel == 2) {
    set_start_pose(device);
    if (++c.init_wait > 10) {
      params.sublevel = 3;
      c.init_wait = 0;
    }
  } else if (params.sublevel == 3) {
    c.initialized = true;
  }
#ifdef RAVENCAL_CRTK
  for (int i = 0; i < kMechanismRoom; ++i) device.mech[i].joint_control = false;
#endif
}

// False: it failed and left this arm and those after it as they were.
inline bool inverse_kinematics_of_all(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    mechanism& m = device.mech[i];
    const six_joints measured = {{m.joint[0].jpos, m.joint[1].jpos, m.joint[2].jpos,
                                  m.joint[4].jpos, m.joint[5].jpos,
                                  (m.joint[7].jpos - m.joint[6].jpos) / 2.0F}};
    six_joints solution;
    if (!inverse_kinematics(is_gold(m), pose_of(m.pos_d, m.ori_d), measured, solution)) {
      return false;
    }
    bool limited = false;
    for (int j = 0; j < 3; ++j) {
      const double low = static_cast<double>(kLowest[j]), high = static_cast<double>(kHighest[j]);
      limited = limited || solution.value[j] <= low || solution.value[j] >= high;
      solution.value[j] = solution.value[j] <= low    ? low
                          : solution.value[j] >= high ? high
                                                      : solution.value[j];
    }
    const float jaws = static_cast<float>(m.ori_d.grasp) / 1000.0F;
    const int slots[5] = {0, 1, 2, 4, 5};
    for (int k = 0; k < 5; ++k) {
      m.joint[slots[k]].jpos_d = static_cast<float>(solution.value[k]);
    }
    m.joint[6].jpos_d = static_cast<float>(-solution.value[5]) + jaws / 2.0F;
    m.joint[7].jpos_d = static_cast<float>(solution.value[5]) + jaws / 2.0F;
    if (!limited) continue;
    float joints[8];
    for (int j = 0; j < 8; ++j) joints[j] = m.joint[j].jpos_d;
    const int grasp = m.ori_d.grasp;
    forward_kinematics(is_gold(m), joints, m.pos_d, m.ori_d);
    m.ori_d.grasp = grasp;
  }
  return true;
}

// Hard stops are found after the amplifiers' second; then the arm moves to its home position.
// Returns whether the motors' desired positions are to be computed.
inline bool homing(robot_device& device, control_state& c, const param_pass& params) {
  const int stop = 1200, home = 2200;
  if (params.runlevel != kInitLevel || params.sublevel != 3) {
    c.homing_cycles = 0;
    return false;
  }
  ++c.homing_cycles;
  if (c.homing_cycles <= 1000) return false;
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      DOF& joint = device.mech[i].joint[j];
      if (c.homing_cycles == 1001) joint.jpos_d = joint.jpos;
      joint.state = c.homing_cycles < stop ? jstate_not_ready : jstate_homing1;
      if (c.homing_cycles == stop) {
        joint.jpos_d = kHome[j] + 0.05F;
        joint.mpos_d = kRatio[j] * joint.jpos_d;
      }
      if (c.homing_cycles > stop) joint.jpos_d += (kHome[j] - joint.jpos_d) * 0.01F;
      if (c.homing_cycles > home) joint.state = jstate_ready;
    }
    if (c.homing_cycles != stop) continue;
    inverse_coupling(device.mech[i]);  // as set_joints_known_pos does, past the wrapper
    for (int j = 0; j < 8; ++j) {
      DOF& joint = device.mech[i].joint[j];
      joint.enc_offset = joint.enc_val - static_cast<int>(joint.mpos_d * kCountsPerRad);
    }
  }
  return true;
}

inline bool all_ready(const robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      if (j != 3 && device.mech[i].joint[j].state != jstate_ready) return false;
    }
  }
  return true;
}

inline void forget_home(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      if (j != 3) device.mech[i].joint[j].state = jstate_not_ready;
    }
  }
}

// The control law up to the inverse cable coupling; returns whether that one is to run.
inline bool control_law(robot_device& device, control_state& c, const param_pass& params) {
  if (c.mode == homing_mode) {
    const bool couples = homing(device, c, params);
    desired_pose_to_actual(device);
    if (all_ready(device)) {
      c.mode = cartesian_mode;
      c.homing_wanted = false;
    }
    return couples;
  }
  if (params.runlevel < kUp) return false;
  if (params.runlevel == kUp) desired_pose_to_actual(device);
#ifdef RAVENCAL_CRTK
  if (device.mech[0].joint_control || device.mech[1].joint_control) {
    c.countdown = 10;
    desired_pose_to_actual(device);
  } else if (c.countdown > 0) {
    --c.countdown;
  } else {
    inverse_kinematics_of_all(device);
  }
#else
  inverse_kinematics_of_all(device);
#endif
  return true;
}

}  // namespace LOOKALIKE
