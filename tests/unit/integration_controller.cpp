// SPDX-License-Identifier: Apache-2.0
//
// The controller's cycle in miniature, around the look-alike structures: run level, commands,
// encoders, forward cable coupling, hook, kinematics, control law (integration_control.hpp),
// inverse cable coupling, torque, publishing. Compiled as gnu++98, the controllers' age, and as
// C++17. RAVENCAL_ENTRY names the build.
#include "unit/integration_controller.h"

#include <math.h>
#include <string.h>

#include <string>

#include "rt_plugin/integration/controller.hpp"
#include "unit/integration_control.hpp"
#include "unit/integration_publish.hpp"
#include "unit/integration_structures.hpp"

using namespace LOOKALIKE;

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
  if (device.unhome_trigger != 1) return all_ready(device);
  device.unhome_trigger = 0;
  forget_home(device);
  return false;
}
#endif

}  // namespace

struct controller {
  robot_device device;
  param_pass params;
  control_state control;
  float motor[kMechanismRoom][8];  // true motor angles: the mechanics
  long cycle_number;
  double message[240];
  int lines;
  Adapter adapter;
  ravencal::ControllerSettings settings;
  int green;
  int soft_stopped;
  int moving;      // 1: the operator moves the arms while the pedal is down
  int joint_arms;  // CRTK: bit 0, the calibrated arm gets joint commands; bit 1, the other one
  float joint_step_ji[3];
  int tip_um[3];   // added to the calibrated arm's desired position in each cycle
  int has_pose;    // a client writes the calibrated arm's desired position in each cycle
  int pose_um[3];  // this one
  std::string error;
};

namespace {

mechanism& calibrated(controller& c) { return c.device.mech[c.green ? kGreenIndex : kGoldIndex]; }
// As the lines that a user adds have it.
int sublevel_for_adapter(const controller& c) {
#ifdef RAVENCAL_CRTK
  return c.adapter.all_joints_ready(c.device);
#else
  return c.params.sublevel;
#endif
}

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

// The operator moves the tips, or nobody does.
commands collect_commands(controller& c) {
  commands given;
  memset(&given, 0, sizeof given);
  const float t = static_cast<float>(c.cycle_number) * 1e-3F;
  for (int i = 0; i < kMechanisms && c.moving; ++i) {
    for (int k = 0; k < 3; ++k) {
      given.pose_um[i][k] = static_cast<int>(4.0F * cosf(t + static_cast<float>(i + k)));
    }
  }
  for (int i = 0; i < 2; ++i) {
    const bool is_calibrated = &c.device.mech[i] == &calibrated(c);
    given.joints[i] = (c.joint_arms & (is_calibrated ? 1 : 2)) != 0;
    for (int j = 0; j < 3; ++j) given.joint_ji[i][j] = c.joint_step_ji[j];
  }
  const int own = c.green ? kGreenIndex : kGoldIndex;
  for (int k = 0; k < 3; ++k) given.pose_um[own][k] += c.tip_um[k];
  given.has_pose[own] = c.has_pose != 0;
  for (int k = 0; k < 3; ++k) given.position_um[own][k] = c.pose_um[k];
  return given;
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

void torques(controller& c, bool couples) {
  const bool powered = c.params.runlevel == kDown || (c.control.mode == homing_mode && couples);
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

controller* start(const controller_setup* setup) {
  controller* const c = new controller;
  memset(static_cast<void*>(&c->device), 0, sizeof c->device);
  memset(&c->params, 0, sizeof c->params);
  memset(c->motor, 0, sizeof c->motor);
  memset(c->message, 0, sizeof c->message);
  c->params.last_sequence = 111;
  c->cycle_number = 0;
  memset(&c->control, 0, sizeof c->control);
  c->lines = setup->lines;
  c->green = setup->green;
  c->soft_stopped = 0;
  c->moving = 1;
  c->joint_arms = 0;
  memset(c->joint_step_ji, 0, sizeof c->joint_step_ji);
  memset(c->tip_um, 0, sizeof c->tip_um);
  memset(c->pose_um, 0, sizeof c->pose_um);
  c->has_pose = 0;
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
  ravencal::ControllerSettings& settings = c->settings;
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
  if (setup->fault != SETTINGS_NO_LIMITS) {
    memcpy(settings.limits.lowest_ji, kLowest, sizeof kLowest);
    memcpy(settings.limits.highest_ji, kHighest, sizeof kHighest);
  }
  if (setup->fault == SETTINGS_WIDE_LIMITS) {
    for (int j = 0; j < 3; ++j) settings.limits.lowest_ji[j] = -settings.limits.highest_ji[j];
    for (int j = 0; j < 3; ++j) settings.limits.highest_ji[j] *= 2.0F;
  }
  settings.limits.remote_centre_m = 0.47F;
  settings.limits.remote_centre_radius_m = setup->fault == SETTINGS_NO_CENTRE ? 0.0F : 0.013F;
  settings.step_budget_ns = setup->step_budget_ns;
  settings.mode = setup->in_shadow ? RAVENCAL_MODE_SHADOW : RAVENCAL_MODE_ARM;
  settings.resume_after_stop = setup->in_shadow ? 0 : 1;
  if (setup->fault == SETTINGS_ONE_SLOT) {
    settings.other.message_slot = settings.calibrated.message_slot;
  }
  if (setup->wrong_slot) {
    settings.calibrated.message_slot = 1 - settings.calibrated.message_slot;
    settings.other.message_slot = 1 - settings.other.message_slot;
  }
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

void cycle(controller* c, int level) {
  ++c->cycle_number;
  const int64_t t_ns = static_cast<int64_t>(c->cycle_number) * 1000000;
  state_machine(c->control, c->params, level);
  const int runlevel = c->params.runlevel;
  if (runlevel == kEStop) {
    c->soft_stopped = 0;
    if (c->control.homing_wanted) c->control.mode = homing_mode;
  }
  for (int i = 0; i < kMechanisms; ++i) {
    for (int j = 0; j < 8; ++j) c->device.mech[i].joint[j].current_cmd = 0;  // clearDACs
  }
  take_commands(c->device, c->params, collect_commands(*c));
  if (c->soft_stopped) c->device.mech[0].joint[0].state = jstate_pos_unknown;
  initialize(c->device, c->control, c->params);
  state_estimate(*c);
  for (int i = 0; i < kMechanisms; ++i) forward_coupling(c->device.mech[i]);
  if (c->lines != CONTROLLER_WITHOUT) {
    c->adapter.correct(c->device, c->params.runlevel, sublevel_for_adapter(*c),
                       c->params.last_sequence, t_ns);
  }
  forward_kinematics_of_all(c->device, runlevel);
  const bool couples = control_law(c->device, c->control, c->params);
  if (couples) inverse_coupling_of_all(*c);
  torques(*c, couples);
#ifdef RAVENCAL_CRTK
  if (c->device.unhome_trigger > 0) {
    c->device.robot_homed = 0;
  } else if (robot_ready(c->device)) {
    c->device.robot_homed = 1;
  }
#endif
#ifdef RAVENCAL_CRTK
  const int sublevel = robot_ready(c->device) ? 1 : 0;
#else
  const int sublevel = c->params.sublevel;
#endif
  publish(c->device, c->params, c->cycle_number, sublevel, c->message);
  if (c->lines != CONTROLLER_WITHOUT) {
    c->adapter.observe(c->device, c->params.runlevel, sublevel_for_adapter(*c),
                       c->params.last_sequence);
  }
}

// As the commands to unhome and to home have it; the mode changes in E-stop.
void begin_homing(controller* c) {
  forget_home(c->device);
  c->control.homing_wanted = true;
}
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
void command_joints(controller* c, int arms, const float step_ji[3]) {
  c->joint_arms = arms;
  memcpy(c->joint_step_ji, step_ji, sizeof c->joint_step_ji);
}
void command_tip(controller* c, const int step_um[3]) {
  memcpy(c->tip_um, step_um, sizeof c->tip_um);
}
void command_pose(controller* c, const int* position_um) {
  c->has_pose = position_um != 0;
  if (position_um != 0) memcpy(c->pose_um, position_um, sizeof c->pose_um);
}
void tip(const controller* c, int position_um[3]) {
  const mechanism& m = calibrated(*const_cast<controller*>(c));
  position_um[0] = m.pos.x;
  position_um[1] = m.pos.y;
  position_um[2] = m.pos.z;
}
void press(controller* c, int down) { c->device.surgeon_mode = down; }
void move_by_hand(controller* c, int other, const float by_ji[3]) {
  const int index = c->green == (other == 0) ? kGreenIndex : kGoldIndex;
  mechanism moved = c->device.mech[index];
  for (int j = 0; j < 8; ++j) moved.joint[j].jpos_d = j < 3 ? by_ji[j] : 0.0F;
  inverse_coupling(moved);
  for (int j = 0; j < 3; ++j) c->motor[index][j] += moved.joint[j].mpos_d;
}
// Everything but what the plugin did to it.
void adopt(controller* c, const controller* from) {
  const ravencal_output& corrected = from->adapter.output();
  c->device = from->device;
  c->params = from->params;
  c->control = from->control;
  c->cycle_number = from->cycle_number;
  c->soft_stopped = from->soft_stopped;
  memcpy(c->motor, from->motor, sizeof c->motor);
  for (int j = 0; j < 3; ++j) {
    DOF& joint = calibrated(*c).joint[j];
    joint.jpos -= corrected.correction_ji[j];
    joint.jpos_d -= corrected.correction_ji[j];
  }
  // The desired pose holds the correction too; the arm has arrived there.
  mechanism& own = calibrated(*c);
  kinematics(own);
  own.pos_d = own.pos;
  own.ori_d = own.ori;
}
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
void shadow(controller* c) { c->adapter.shadow(); }
void set_share(controller* c, float share, unsigned joints) { c->adapter.set_share(share, joints); }
int open_again(controller* c) {
  const bool opened = c->adapter.open(c->settings, c->device);
  c->error = c->adapter.error();
  return opened ? 1 : 0;
}
int arms_agree(controller* c) {
  const bool agree = c->adapter.arms_agree(c->device);
  c->error = c->adapter.error();
  return agree ? 1 : 0;
}
void reset(controller* c) { c->adapter.reset(); }
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
  mechanism& m = calibrated(*const_cast<controller*>(c));
  for (int j = 0; j < 3; ++j) {
    mpos[j] = m.joint[j].mpos;
    mpos_d[j] = m.joint[j].mpos_d;
  }
}
void joints(const controller* c, float jpos[3], float jpos_d[3]) {
  mechanism& m = calibrated(*const_cast<controller*>(c));
  for (int j = 0; j < 3; ++j) {
    jpos[j] = m.joint[j].jpos;
    jpos_d[j] = m.joint[j].jpos_d;
  }
}
void true_motors(const controller* c, float motor[3]) {
  memcpy(motor, c->motor[c->green ? kGreenIndex : kGoldIndex], 3 * sizeof(float));
}
int runlevel_of(const controller* c) { return c->params.runlevel; }
void stop(controller* c) { delete c; }

const controller_api kApi = {
#ifdef RAVENCAL_CRTK
    "crtk",
#else
    "main",
#endif
    start,          error,       cycle,        begin_homing, unhome,     soft_stop,    command,
    command_joints, command_tip, command_pose, tip,          press,      move_by_hand, adopt,
    enable,         shadow,      set_share,    open_again,   arms_agree, reset,        load,
    published,      seen,        output,       device,       motors,     joints,       true_motors,
    runlevel_of,    is_homed,    early_reads,  stop};

}  // namespace

extern "C" const controller_api* RAVENCAL_ENTRY(void);
extern "C" const controller_api* RAVENCAL_ENTRY(void) { return &kApi; }
