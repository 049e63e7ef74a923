// SPDX-License-Identifier: Apache-2.0
//
// The lines that rt_plugin/integration/README.md gives a user, taken from it, in a controller that
// has no more than they need. RAVENCAL_CRTK: those of the CRTK branch.
#include <stddef.h>

#include "unit/integration_structures.hpp"
using namespace LOOKALIKE;

// As defines.h and r2_kinematics.h of the controller have them.
#define SHOULDER_MIN_LIMIT (float)0.0
#define SHOULDER_MAX_LIMIT (float)1.57
#define ELBOW_MIN_LIMIT (float)0.785
#define ELBOW_MAX_LIMIT (float)2.356
#define Z_INS_MIN_LIMIT (float)0.23
#define Z_INS_MAX_LIMIT (float)0.56
#ifndef RAVENCAL_CRTK
#define GOLD_ARM kGoldType
#define GREEN_ARM kGreenType
#include "readme_header_main.inc"
#else
#include "readme_header_crtk.inc"
#endif

// Compiled only.
#define UNUSED __attribute__((unused))

namespace {

const double d4 = -0.47;
const double Lw = 0.013;
const int NUM_MECH = 2;
Calibration calibration_of_build;
#define calibration calibration_of_build

#ifdef RAVENCAL_CRTK
#include "readme_arms_crtk.inc"
#else
#include "readme_arms_main.inc"
#endif

int log_msg(const char*, const char*) { return 0; }

UNUSED void open_adapter(robot_device& device0){
#include "readme_open.inc"
}

UNUSED void end_of_cycle(robot_device& device0, param_pass& currParams){
#ifdef RAVENCAL_CRTK
#include "readme_observe_crtk.inc"
#else
#include "readme_observe_main.inc"
#endif
}

UNUSED void hook(robot_device* device0, param_pass* currParams){
#ifdef RAVENCAL_CRTK
#include "readme_correct_crtk.inc"
#else
#include "readme_correct_main.inc"
#endif
}

UNUSED void inverse_coupling(robot_device* device0) {
#include "readme_uncorrect.inc"
}

}  // namespace
