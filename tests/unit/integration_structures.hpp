// SPDX-License-Identifier: Apache-2.0
//
// Structures that look like those of the RAVEN-II controller's two branches, as far as the plugin's
// adapter sees them: names, types, array sizes and order of the arms are the controller's, the rest
// is ours. RAVENCAL_CRTK: the CRTK branch, else the main branch. C++98.
#pragma once

#include <string.h>

// Both branches are linked into one program.
#ifdef RAVENCAL_CRTK
#define LOOKALIKE lookalike_crtk
#else
#define LOOKALIKE lookalike_main
#endif

namespace LOOKALIKE {

typedef unsigned char u_08;
typedef unsigned short u_16;
typedef short s_16;
typedef int s_24;
typedef unsigned int u_32;

enum jointState {
  jstate_not_ready,
  jstate_pos_unknown,
  jstate_homing1,
  jstate_homing2,
  jstate_ready
};

#ifdef RAVENCAL_CRTK
// USB serials: green 50, gold 37. Boards are sorted by name, the greatest first; a third arm's
// board has a lower one. Its type is that of the arm on the same side; its name is its own.
enum { kGoldType = 0, kGreenType = 1, kMechanisms = 3, kMechanismRoom = 4 };
enum { kGoldIndex = 1, kGreenIndex = 0 };
enum mech_name { gold, green, blue, orange };
#else
// The type is the board's USB serial: gold 49, green 22.
enum { kGoldType = 49, kGreenType = 22, kMechanisms = 2, kMechanismRoom = 2 };
enum { kGoldIndex = 0, kGreenIndex = 1 };
#endif

struct position {
  int x, y, z;
};

struct orientation {
  float R[3][3];
  int yaw, pitch, roll;
  int grasp;
};

struct DOF {
  u_16 type;
  jointState state;
  s_24 enc_val;
  s_16 current_cmd;
#ifdef RAVENCAL_CRTK
  s_16 homing_dac;
#endif
  float jpos, mpos, jvel, mvel, tau, tau_d, tau_g, jpos_d, mpos_d, jpos_d_old, mpos_d_old;
  float jvel_d, mvel_d;
  int enc_offset;
  float perror_int;
};

// The controller's is a vector without elements until it is computed for the first time, after the
// hook of the first cycle: reading it earlier ends the process. This one counts such reads.
class r2_jacobian {
 public:
  r2_jacobian() : is_computed(false), early_reads(0) { memset(velocity, 0, sizeof velocity); }
  void get_vel(float* to) {
    if (!is_computed) ++early_reads;
    memcpy(to, velocity, sizeof velocity);
  }
  float velocity[6];
  bool is_computed;
  int early_reads;
};

struct mechanism {
#ifdef RAVENCAL_CRTK
  int name;
  int serial;
  bool joint_control;
#endif
  u_16 type;
  int tool_type;
  position pos, pos_d, base_pos;
  orientation ori, ori_d, base_ori;
  DOF joint[8];
  u_08 inputs, outputs;
  r2_jacobian r2_jac;
};

struct robot_device {
  u_16 type;
  u_32 timestamp;
  u_08 runlevel, sublevel;
  int surgeon_mode;
  mechanism mech[kMechanismRoom];
#ifdef RAVENCAL_CRTK
  int num_mechs;
  u_08 robot_homed;
  char unhome_trigger;
#endif
  float grav_mag;
  position grav_dir;
};

struct param_pass {
  u_08 runlevel, sublevel;
  int last_sequence;
};

}  // namespace LOOKALIKE
