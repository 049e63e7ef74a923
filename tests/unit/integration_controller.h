/* SPDX-License-Identifier: Apache-2.0
 *
 * A controller in miniature, built once per branch and language standard, as the tests drive it. */
#ifndef RAVENCAL_TESTS_INTEGRATION_CONTROLLER_H
#define RAVENCAL_TESTS_INTEGRATION_CONTROLLER_H

#include <stddef.h>

#include "ravencal/plugin.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CONTROLLER_WITHOUT 0 /* as it was before any line was added */
#define CONTROLLER_WITH 1    /* with the lines */
#define CONTROLLER_ONE_WAY 2 /* with the lines but those of the inverse path */

#define SETTINGS_ONE_SLOT 1    /* both arms have the same message slot */
#define SETTINGS_NO_LIMITS 2   /* the limits of the joints are left out */
#define SETTINGS_WIDE_LIMITS 4 /* they are not those of the inverse kinematics */
#define SETTINGS_NO_CENTRE 3   /* the radius about the remote centre is left out */

typedef struct controller_setup {
  int lines;          /* CONTROLLER_* */
  const char* plugin; /* null: the plugin is not opened */
  const char* weights;
  const char* telemetry;
  int green;      /* 1: the green arm is the calibrated one */
  int absent_arm; /* 1: the settings name an arm that the robot lacks */
  int by_type;    /* 1: arms are told apart by type, also where types are not unique */
  int wrong_slot; /* 1: the settings give each arm the other one's message slot */
  int fault;      /* SETTINGS_* */
  unsigned step_budget_ns;
  int in_shadow; /* 1: as the adapter opens by default; 0: the correction is asked for at once */
} controller_setup;

typedef struct controller controller;

typedef struct controller_api {
  const char* branch;
  controller* (*start)(const controller_setup* setup);
  const char* (*error)(const controller* self);
  /* One millisecond in which the PLC shows that run level. */
  void (*cycle)(controller* self, int runlevel);
  void (*begin_homing)(controller* self);
  /* CRTK's command; nothing in the main branch. */
  void (*unhome)(controller* self);
  /* Ends when the run level becomes 0. */
  void (*soft_stop)(controller* self);
  /* Whether the operator moves the arms while the pedal is down. */
  void (*command)(controller* self, int moving);
  /* CRTK: a client streams joint increments, zeros perhaps; bit 0: to the calibrated arm, bit 1: to
   * the other one. */
  void (*command_joints)(controller* self, int arms, const float step_ji[3]);
  /* The operator moves the calibrated arm's tip by so much per cycle. */
  void (*command_tip)(controller* self, const int step_um[3]);
  /* A client sets the calibrated arm's desired position, in each cycle in which the controller
   * takes commands; null: it has left. */
  void (*command_pose)(controller* self, const int* position_um);
  /* Where the calibrated arm's tip is, as published. */
  void (*tip)(const controller* self, int position_um[3]);
  /* CRTK: the request to press the pedal, which the PLC follows later. */
  void (*press)(controller* self, int down);
  /* Somebody moves the joints of the calibrated arm, or of the other one, while no motor does. */
  void (*move_by_hand)(controller* self, int other, const float by_ji[3]);
  /* Goes on from the state of another controller, without its correction. */
  void (*adopt)(controller* self, const controller* from);
  void (*enable)(controller* self, int on);
  void (*shadow)(controller* self);
  void (*set_share)(controller* self, float share, unsigned joints);
  /* Opens the adapter again with the same settings; whether it agreed. */
  int (*open_again)(controller* self);
  int (*arms_agree)(controller* self);
  void (*reset)(controller* self);
  int (*load)(controller* self, const char* weights);
  /* raven_state as it was published last, 240 values in the order of the catalogue, gold first. */
  void (*published)(const controller* self, double message[240]);
  /* What the adapter handed to the plugin last, at the end of the cycle. */
  const ravencal_state* (*seen)(const controller* self);
  const ravencal_output* (*output)(const controller* self);
  const void* (*device)(const controller* self, size_t* bytes);
  /* Of the calibrated arm's first three joints. */
  void (*motors)(const controller* self, float mpos[3], float mpos_d[3]);
  void (*joints)(const controller* self, float jpos[3], float jpos_d[3]);
  /* Angles of the calibrated arm's first three motors: the true joints, in motor angles. */
  void (*true_motors)(const controller* self, float motor_rad[3]);
  int (*runlevel)(const controller* self);
  int (*is_homed)(const controller* self);
  /* Jacobians read before the controller had computed one: the real process ends there. */
  int (*early_reads)(const controller* self);
  void (*stop)(controller* self);
} controller_api;

#ifdef __cplusplus
}
#endif

#endif
