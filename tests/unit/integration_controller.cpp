// SPDX-License-Identifier: Apache-2.0
//
// The controller's cycle in miniature, around the look-alike structures: encoders, forward cable
// coupling, hook, kinematics, control law, inverse cable coupling, torque, publishing. Compiled as
// gnu++98, the controllers' age, and as C++17. RAVENCAL_ENTRY names the build.
#include "unit/integration_controller.h"

#include <math.h>
#include <string.h>

#include <string>

#include "rt_plugin/integration/controller.hpp"
#include "unit/integration_kinematics.hpp"
#include "unit/integration_structures.hpp"

using namespace lookalike;

namespace {

#ifdef RAVENCAL_CRTK
typedef ravencal::ControllerAdapter<robot_device, ravencal::ByName> Adapter;
typedef ravencal::ControllerAdapter<robot_device> AdapterByType;
#else
typedef ravencal::ControllerAdapter<robot_device> Adapter;
#endif

#ifdef RAVENCAL_CRTK
// Not only a question: it un-homes the robot if that was asked for.
bool robot_ready(robot_device& device) {
  if (device.unhome_trigger == 1) {
    device.unhome_trigger = 0;
    for (int i = 0; i < kMechanisms; ++i) {
      for (int j = 0; j < 8; ++j) {
        if (j != 3) device.mech[i].joint[j].state = jstate_not_ready;
      }
    }
    return false;
  }
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      if (j != 3 && device.mech[i].joint[j].state != jstate_ready) return false;
    }
  }
  return true;
}
#endif

}  // namespace

struct controller {
  robot_device device;
  param_pass params;
  float motor[kMechanismRoom][8];  // true motor angles: the mechanics
  long cycle_number;
  int homing_cycles;
  double message[240];
  int lines;
  Adapter adapter;
  int green;
  int soft_stopped;
  int moving;  // 1: the operator moves the arms while the pedal is down
  std::string error;

  mechanism& calibrated() { return device.mech[green ? kGreenIndex : kGoldIndex]; }
  // As the lines that a user adds have it.
  int sublevel_for_adapter() const {
#ifdef RAVENCAL_CRTK
    return adapter.all_joints_ready(device);
#else
    return params.sublevel;
#endif
  }
};

namespace {

void state_estimate(controller& c) {
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      DOF& joint = c.device.mech[i].joint[j];
      const float before = joint.mpos;
      joint.enc_val = static_cast<int>(floorf(c.motor[i][j] * kCountsPerRad + 0.5F)) + 100 * j + i;
      joint.mpos = static_cast<float>(joint.enc_val - joint.enc_offset) / kCountsPerRad;
      joint.mvel = (joint.mpos - before) * 1000.0F;
      joint.jvel = joint.mvel / kRatio[j];
    }
  }
}

// Hard stops are found in the middle of homing; then the arm moves to its home position.
void homing(controller& c) {
  ++c.homing_cycles;
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      DOF& joint = c.device.mech[i].joint[j];
      joint.state = c.homing_cycles < 200 ? jstate_homing1 : jstate_homing2;
      if (c.homing_cycles == 200) {
        joint.jpos_d = kHome[j] + 0.05F;
        joint.mpos_d = kRatio[j] * joint.jpos_d;
      }
      if (c.homing_cycles > 200) joint.jpos_d += (kHome[j] - joint.jpos_d) * 0.01F;
      if (c.homing_cycles > 1200) joint.state = jstate_ready;
    }
    if (c.homing_cycles != 200) continue;
    inverse_coupling(c.device.mech[i]);  // as set_joints_known_pos does, past the wrapper
    for (int j = 0; j < 8; ++j) {
      DOF& joint = c.device.mech[i].joint[j];
      joint.enc_offset = joint.enc_val - static_cast<int>(joint.mpos_d * kCountsPerRad);
    }
  }
}

void set_desired_to_actual(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) device.mech[i].joint[j].jpos_d = device.mech[i].joint[j].jpos;
    device.mech[i].ori_d.grasp = 250 + i;
  }
}

void teleoperate(controller& c) {
  const float t = static_cast<float>(c.cycle_number) * 1e-3F;
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 3; ++j) {
      const float speed = (j == 2 ? 0.004F : 0.02F) * cosf(t + static_cast<float>(i + j));
      c.device.mech[i].joint[j].jpos_d += speed * 1e-3F;
    }
  }
}

// The inverse kinematics keep the desired joints, corrected ones, within their limits.
void saturate(robot_device& device) {
  const float lowest[3] = {0.0F, 0.785398F, 0.23F};
  const float highest[3] = {1.570796F, 2.356194F, 0.56F};
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 3; ++j) {
      float& desired = device.mech[i].joint[j].jpos_d;
      if (desired < lowest[j]) desired = lowest[j];
      if (desired > highest[j]) desired = highest[j];
    }
  }
}

// The wrapper that every control law calls.
void inverse_coupling_of_all(controller& c) {
  if (c.lines == CONTROLLER_WITH) {
    ravencal::UncorrectedDesired<Adapter, robot_device> desired(c.adapter, c.device);
    for (int i = 0; i < kMechanisms; ++i) inverse_coupling(c.device.mech[i]);
    return;
  }
  for (int i = 0; i < kMechanisms; ++i) inverse_coupling(c.device.mech[i]);
}

void torques(controller& c) {
  const bool powered = c.params.runlevel == 1 || c.params.runlevel == 3;
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) {
      DOF& joint = c.device.mech[i].joint[j];
      const float kp = powered ? 0.2F : 0.0F;
      joint.tau_d = kp * (joint.mpos_d - joint.mpos);
      const float dac = -3695.81F * joint.tau_d;
      joint.current_cmd = static_cast<s_16>(dac > 2500.0F    ? 2500.0F
                                            : dac < -2500.0F ? -2500.0F
                                                             : dac);
      if (c.soft_stopped) joint.current_cmd = 0;
      c.motor[i][j] += 0.05F * (static_cast<float>(joint.current_cmd) / -3695.81F) / 0.2F;
    }
  }
}

// raven_state in its own units and with its own mixture of arms, in the catalogue's order: see
// shared/core/catalogue.hpp. Written after the message's field table, not after the adapter.
void publish(controller& c) {
  const double deg = 180.0 / kPi;
  double* const m = c.message;
  memset(c.message, 0, sizeof c.message);
  m[0] = static_cast<double>(c.cycle_number) * 1e-3;
  m[17] = c.params.runlevel;
#ifdef RAVENCAL_CRTK
  m[18] = robot_ready(c.device) ? 1 : 0;
#else
  m[18] = c.params.sublevel;
#endif
  m[19] = c.params.last_sequence;
  for (int slot = 0; slot < 2; ++slot) {
    mechanism& mech = c.device.mech[slot];  // by slot, whichever arm that is
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

controller* start(const controller_setup* setup) {
  controller* const c = new controller;
  memset(static_cast<void*>(&c->device), 0, sizeof c->device);
  memset(&c->params, 0, sizeof c->params);
  memset(c->motor, 0, sizeof c->motor);
  memset(c->message, 0, sizeof c->message);
  c->params.last_sequence = 111;
  c->cycle_number = 0;
  c->homing_cycles = 0;
  c->lines = setup->lines;
  c->green = setup->green;
  c->soft_stopped = 0;
  c->moving = 1;
  for (int i = 0; i < kMechanisms; ++i) {
    mechanism& m = c->device.mech[i];
    // A third mechanism is another arm on the gold side.
    m.type = static_cast<u_16>(i == kGreenIndex ? kGreenType : kGoldType);
#ifdef RAVENCAL_CRTK
    m.name = i == kGoldIndex ? gold : i == kGreenIndex ? green : blue;
#endif
    for (int j = 0; j < 8; ++j) {
      c->motor[i][j] = 0.3F * static_cast<float>(j + 1) + 0.1F * static_cast<float>(i);
    }
  }
  if (setup->plugin == 0) return c;
  ravencal::ControllerSettings settings;
  settings.plugin = setup->plugin;
  settings.weights = setup->weights;
  settings.telemetry = setup->telemetry;
#ifdef RAVENCAL_CRTK
  const ravencal::ArmSettings gold_arm = {gold, 0};
  const ravencal::ArmSettings green_arm = {green, 1};
#else
  const ravencal::ArmSettings gold_arm = {kGoldType, 0};
  const ravencal::ArmSettings green_arm = {kGreenType, 1};
#endif
  settings.calibrated = setup->green ? green_arm : gold_arm;
  settings.other = setup->green ? gold_arm : green_arm;
  if (setup->absent_arm) settings.calibrated.id = 7;
  settings.mechanisms = kMechanisms;
  settings.poses_as_published = 1;
#ifdef RAVENCAL_CRTK
  if (setup->by_type) {
    settings.calibrated.id = kGoldType;
    settings.other.id = kGreenType;
    AdapterByType by_type;
    by_type.open(settings, c->device);
    c->error = by_type.error();
    return c;
  }
#endif
  c->adapter.open(settings, c->device);
  c->error = c->adapter.error();
  return c;
}

// The controller sets the joints' types when it first comes to INIT, after the plugin was opened.
void set_joint_types(robot_device& device) {
  for (int i = 0; i < kMechanisms; ++i) {
    const int first = i == kGoldIndex ? 0 : i == kGreenIndex ? 8 : 16;
    for (int j = 0; j < 8; ++j) device.mech[i].joint[j].type = static_cast<u_16>(first + j);
  }
}

void cycle(controller* c, int runlevel) {
  ++c->cycle_number;
  const int64_t t_ns = static_cast<int64_t>(c->cycle_number) * 1000000;
  c->params.runlevel = static_cast<u_08>(runlevel);
  c->params.sublevel = static_cast<u_08>(runlevel == 1 ? 3 : 0);
  if (runlevel == 0) c->soft_stopped = 0;
  if (runlevel == 1) set_joint_types(c->device);
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) c->device.mech[i].joint[j].current_cmd = 0;  // clearDACs
  }
  if (c->soft_stopped) c->device.mech[0].joint[0].state = jstate_pos_unknown;
  state_estimate(*c);
  for (int i = 0; i < kMechanisms; ++i) forward_coupling(c->device.mech[i]);
  if (c->lines != CONTROLLER_WITHOUT) {
    c->adapter.correct(c->device, c->params.runlevel, c->sublevel_for_adapter(),
                       c->params.last_sequence, t_ns);
  }
  for (int i = 0; i < kMechanisms; ++i) kinematics(c->device.mech[i]);
  if (runlevel == 1) homing(*c);
  if (runlevel == 2) set_desired_to_actual(c->device);
  if (runlevel == 3 && c->moving) teleoperate(*c);
  if (runlevel == 3) saturate(c->device);
  for (int i = 0; i < kMechanisms; ++i) desired_kinematics(c->device.mech[i]);
  if (runlevel > 0) inverse_coupling_of_all(*c);
  torques(*c);
#ifdef RAVENCAL_CRTK
  if (c->device.unhome_trigger > 0) {
    c->device.robot_homed = 0;
  } else if (robot_ready(c->device)) {
    c->device.robot_homed = 1;
  }
#endif
  publish(*c);
  if (c->lines != CONTROLLER_WITHOUT) {
    c->adapter.observe(c->device, c->params.runlevel, c->sublevel_for_adapter(),
                       c->params.last_sequence);
  }
}

void begin_homing(controller* c) { c->homing_cycles = 0; }
const char* error(const controller* c) { return c->error.c_str(); }
void unhome(controller* c) {
#ifdef RAVENCAL_CRTK
  c->device.unhome_trigger = 1;
#else
  (void)c;
#endif
}
void soft_stop(controller* c) { c->soft_stopped = 1; }
void command(controller* c, int moving) { c->moving = moving; }
int is_homed(const controller* c) {
#ifdef RAVENCAL_CRTK
  return c->device.robot_homed;
#else
  (void)c;
  return 1;
#endif
}
int early_reads(const controller* c) {
  int sum = 0;
  for (int i = 0; i < kMechanisms; ++i) sum += c->device.mech[i].r2_jac.early_reads;
  return sum;
}
void enable(controller* c, int on) { c->adapter.enable(on); }
int load(controller* c, const char* weights) { return c->adapter.load(weights) ? 1 : 0; }
void published(const controller* c, double message[240]) {
  memcpy(message, c->message, sizeof c->message);
}
const ravencal_state* seen(const controller* c) { return &c->adapter.state(); }
const ravencal_output* output(const controller* c) { return &c->adapter.output(); }
const void* device(const controller* c, size_t* bytes) {
  *bytes = sizeof c->device;
  return &c->device;
}
void motors(const controller* c, float mpos[3], float mpos_d[3]) {
  mechanism& m = const_cast<controller*>(c)->calibrated();
  for (int j = 0; j < 3; ++j) {
    mpos[j] = m.joint[j].mpos;
    mpos_d[j] = m.joint[j].mpos_d;
  }
}
void joints(const controller* c, float jpos[3], float jpos_d[3]) {
  mechanism& m = const_cast<controller*>(c)->calibrated();
  for (int j = 0; j < 3; ++j) {
    jpos[j] = m.joint[j].jpos;
    jpos_d[j] = m.joint[j].jpos_d;
  }
}
void stop(controller* c) { delete c; }

const controller_api kApi = {
#ifdef RAVENCAL_CRTK
    "crtk",
#else
    "main",
#endif
    start,     error, cycle,  begin_homing, unhome, soft_stop, command,  enable,      load,
    published, seen,  output, device,       motors, joints,    is_homed, early_reads, stop};

}  // namespace

extern "C" const controller_api* RAVENCAL_ENTRY(void);
extern "C" const controller_api* RAVENCAL_ENTRY(void) { return &kApi; }
