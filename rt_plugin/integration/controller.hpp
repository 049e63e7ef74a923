// SPDX-License-Identifier: Apache-2.0
//
// Ties the plugin to the RAVEN-II controller (r2_control): fills ravencal_state from the
// controller's own structures and writes the corrected joints back. A template over the
// controller's device type: it compiles against the controller's headers and includes none of them.
// Plain C++98, no libraries but libdl. README.md says which lines go where.
//
// Threads: open, close: not the real-time thread, and not while it calls the others. load: not the
// real-time thread. enable, shadow, set_share, reset: any.
// correct, uncorrect, restore, observe, all_joints_ready: the real-time thread; bounded, no
// allocation, no lock. An adapter that is not open, or whose open failed, changes nothing. It only
// reads fields of the controller's structures and calls none of its functions but r2_jac.get_vel.
#ifndef RAVENCAL_CONTROLLER_HPP
#define RAVENCAL_CONTROLLER_HPP

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "arms.hpp"
#include "ravencal/plugin.h"
#include "settings.hpp"

namespace ravencal {

// Where the Jacobian's velocities come from, which the controller publishes twice, as jac_vel and
// as jac_f: mechanism::r2_jac of the versions since September 2016.
struct PublishedJacobian {
  template <typename Mechanism>
  static void read(Mechanism& mechanism, float (&velocity)[6]) {
    mechanism.r2_jac.get_vel(velocity);
  }
};

// For older controllers, whose mechanisms have no r2_jac and whose message has no jac_vel.
struct NoJacobian {
  template <typename Mechanism>
  static void read(Mechanism&, float (&velocity)[6]) {
    for (int i = 0; i < 6; ++i) velocity[i] = 0.0F;
  }
};

template <typename Device, typename Identity = ByType, typename Jacobian = PublishedJacobian>
class ControllerAdapter {
 public:
  ControllerAdapter() : library_(0), api_(0), instance_(0), storage_(0), saved_(0) {
    memset(uncorrected_ji_, 0, sizeof uncorrected_ji_);
    memset(&state_, 0, sizeof state_);
    memset(&output_, 0, sizeof output_);
    state_.struct_size = sizeof state_;
    output_.struct_size = sizeof output_;
    error_[0] = '\0';
  }
  ~ControllerAdapter() { close(); }

  // Finds the arms in `device`, loads the plugin and the weights, and begins in settings.mode: by
  // default the correction is shown and not applied. False: error() says why, and the controller
  // runs as if nothing had been added. Where only the weights were refused, is_open() is true and
  // load() may bring others. An adapter that is open refuses, and goes on as it was.
  bool open(const ControllerSettings& settings, const Device& device) {
    if (instance_ != 0) return fail("the adapter is open; close it first, with the motors off", "");
    settings_ = settings;
    if (!arms_.find(device, settings.mechanisms, settings.calibrated, settings.other,
                    settings.poses_as_published != 0, error_, sizeof error_) ||
        !settings.limits.are_there(error_, sizeof error_) || !load_library() ||
        !create_instance()) {
      close();
      return false;
    }
    api_->set_mode(instance_, settings.mode);
    return settings.weights == 0 || load(settings.weights);
  }

  // New weights, also while the real-time thread runs; they are faded in. False: error() says why,
  // and the old ones stay.
  bool load(const char* weights) {
    if (instance_ == 0) return fail("the plugin is not open", "");
    if (api_->load(instance_, weights) == RAVENCAL_SUCCESS) return true;
    return fail(api_->last_error(instance_), "");
  }

  // Fades the correction in (1) or out (0), while the pedal is up. Any thread.
  void enable(int on) {
    if (instance_ != 0) api_->enable(instance_, on);
  }

  // Shows what the correction would be, and applies none: one in force fades out, while the pedal
  // is up. Any thread.
  void shadow() {
    if (instance_ != 0) api_->set_mode(instance_, RAVENCAL_MODE_SHADOW);
  }

  // How much of the correction is applied (0..1), and of which joints (bit 0: shoulder), once the
  // pedal is up. False: no such share or joint. Any thread.
  bool set_share(float share, unsigned joints) {
    return instance_ != 0 && api_->set_share(instance_, share, joints) == RAVENCAL_SUCCESS;
  }

  // After a FAULT or too many overruns, with their cause removed: off, until enable(1) or shadow()
  // is called. Any thread.
  void reset() {
    if (instance_ != 0) api_->reset(instance_);
  }

  // Only when the real-time thread has stopped.
  void close() {
    if (instance_ != 0) api_->destroy(instance_);
    instance_ = 0;
    free(storage_);
    storage_ = 0;
    api_ = 0;
    if (library_ != 0) dlclose(library_);
    library_ = 0;
  }

  bool is_open() const { return instance_ != 0; }
  // Whether each arm's joints are those of its message slot: known once the controller has given
  // them types. False: nothing is corrected, and error() says why.
  bool arms_agree(const Device& device) { return arms_.agree(device, error_, sizeof error_); }
  const char* error() const { return error_; }
  const ravencal_api* api() const { return api_; }
  ravencal_instance* instance() const { return instance_; }
  // As handed to the plugin last.
  const ravencal_state& state() const { return state_; }
  const ravencal_output& output() const { return output_; }

  static int64_t monotonic_ns() {
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<int64_t>(now.tv_sec) * 1000000000 + now.tv_nsec;
  }

  // Whether every joint is ready: what the CRTK branch publishes as sublevel. Its own robot_ready
  // also un-homes the robot when that was asked for, so it must be called by the controller alone.
  int all_joints_ready(const Device& device) const {
    return arms_.all_joints_ready(device) ? 1 : 0;
  }

  // The hook: after the forward cable coupling, before the forward kinematics. Replaces jpos of
  // joints 1 to 3 of the calibrated arm; while the motors do not follow, moves their jpos_d with
  // the correction. `sublevel` is what raven_state publishes under that name. Returns what the
  // plugin's step returned.
  int correct(Device& device, int runlevel, int sublevel, int last_sequence,
              int64_t t_ns = monotonic_ns()) {
    if (instance_ == 0) return RAVENCAL_BYPASS;
    fill(device, runlevel, sublevel, last_sequence, t_ns);
    float own_before_ji[RAVENCAL_JOINTS], corrected_before_ji[RAVENCAL_JOINTS];
    memcpy(own_before_ji, uncorrected_ji_, sizeof own_before_ji);
    memcpy(corrected_before_ji, output_.jpos_ji, sizeof corrected_before_ji);
    memcpy(uncorrected_ji_, state_.arm[0].jpos_ji, sizeof uncorrected_ji_);
    const int status = api_->step(instance_, &state_, &output_);
    if (status < 0) return status;
    for (int slot = 0; slot < RAVENCAL_JOINTS; ++slot) {
      if (Joint* joint = arms_.joint(device, slot)) {
        joint->jpos = output_.jpos_ji[slot];
        joint->jpos_d = output_.desired_ji[slot];
      }
    }
    // In INIT the desired pose stays what it was, while the correction has gone.
    if (runlevel == kInit &&
        memcmp(own_before_ji, corrected_before_ji, sizeof own_before_ji) != 0) {
      move_desired_pose(arms_.calibrated(device), corrected_before_ji, own_before_ji);
    }
    return status;
  }

  // Before and after the inverse cable coupling, which turns jpos_d into mpos_d: takes the
  // correction out of jpos_d of the calibrated arm, and puts back what was there, bit for bit.
  void uncorrect(Device& device) {
    if (instance_ == 0 || saved_ != 0) return;
    float desired_ji[RAVENCAL_JOINTS] = {0.0F, 0.0F, 0.0F};
    for (int slot = 0; slot < RAVENCAL_JOINTS; ++slot) {
      const Joint* joint = arms_.joint(device, slot);
      if (joint == 0) return;
      desired_ji[slot] = joint->jpos_d;
    }
    float uncorrected_ji[RAVENCAL_JOINTS];
    api_->uncorrect_command(instance_, desired_ji, 0, uncorrected_ji);
    for (int slot = 0; slot < RAVENCAL_JOINTS; ++slot) {
      saved_ji_[slot] = desired_ji[slot];
      arms_.joint(device, slot)->jpos_d = uncorrected_ji[slot];
    }
    saved_ = 1;
  }
  void restore(Device& device) {
    if (saved_ == 0) return;
    saved_ = 0;
    for (int slot = 0; slot < RAVENCAL_JOINTS; ++slot) {
      if (Joint* joint = arms_.joint(device, slot)) joint->jpos_d = saved_ji_[slot];
    }
  }

  // Where raven_state is published, at the end of every cycle: the same arguments as at the hook.
  void observe(Device& device, int runlevel, int sublevel, int last_sequence) {
    if (instance_ == 0) return;
    fill(device, runlevel, sublevel, last_sequence, state_.t_ns);
    // Reads the Jacobian here only: the controller computes it after the hook, for the first time
    // in its first cycle.
    for (int a = 0; a < FoundArms::kCount; ++a) {
      if (Mechanism* posed = arms_.posed(device, a)) fill_jacobian(*posed, state_.arm[a]);
    }
    take_correction_out();
    api_->observe_cycle_end(instance_, &state_);
  }

 private:
  ControllerAdapter(const ControllerAdapter&);
  ControllerAdapter& operator=(const ControllerAdapter&);

  enum { kInit = 1 };  // run level

  typedef Arms<Device, Identity> FoundArms;
  typedef typename FoundArms::Mechanism Mechanism;
  typedef typename FoundArms::Joint Joint;

  bool fail(const char* what, const char* more) {
    snprintf(error_, sizeof error_, "%s%s", what, more);
    return false;
  }

  bool load_library() {
    library_ = dlopen(settings_.plugin, RTLD_NOW | RTLD_LOCAL);
    if (library_ == 0) return fail("the plugin cannot be loaded: ", dlerror());
    // An object pointer is turned into a function pointer as POSIX prescribes for dlsym.
    ravencal_plugin_entry_fn entry = 0;
    *reinterpret_cast<void**>(&entry) = dlsym(library_, "ravencal_plugin_entry");
    if (entry == 0) return fail(settings_.plugin, " is not a ravencal plugin");
    api_ = entry(RAVENCAL_ABI_MAJOR);
    if (api_ == 0 || api_->struct_size < sizeof(ravencal_api)) {
      return fail(settings_.plugin, " was built for another version of ravencal/plugin.h");
    }
    return true;
  }

  bool create_instance() {
    ravencal_config config;
    memset(&config, 0, sizeof config);
    config.struct_size = sizeof config;
    api_->default_config(&config);
    config.arm = settings_.calibrated.message_slot == 0 ? RAVENCAL_ARM_GOLD : RAVENCAL_ARM_GREEN;
    memcpy(config.lowest_ji, settings_.limits.lowest_ji, sizeof config.lowest_ji);
    memcpy(config.highest_ji, settings_.limits.highest_ji, sizeof config.highest_ji);
    config.remote_centre_m = settings_.limits.remote_centre_m;
    config.remote_centre_radius_m = settings_.limits.remote_centre_radius_m;
    if (settings_.step_budget_ns != 0) config.step_budget_ns = settings_.step_budget_ns;
    config.resume_after_stop = settings_.resume_after_stop != 0 ? 1 : 0;
    config.joint_mask = settings_.joint_mask;
    config.share = settings_.share;
    for (int slot = 0; slot < RAVENCAL_JOINTS; ++slot) {
      const float largest_ji = settings_.max_correction_ji[slot];
      if (largest_ji != 0.0F) config.max_correction_ji[slot] = largest_ji;
    }
    if (settings_.telemetry != 0) {
      strncpy(config.telemetry_name, settings_.telemetry, sizeof config.telemetry_name - 1);
    }
    if (posix_memalign(&storage_, api_->storage_alignment(), api_->storage_size()) != 0) {
      storage_ = 0;
      return fail("no memory for the plugin", "");
    }
    const int code = api_->create(&config, storage_, api_->storage_size(), &instance_);
    if (code == RAVENCAL_SUCCESS) return true;
    instance_ = 0;
    snprintf(error_, sizeof error_,
             "the plugin refuses its configuration (code %d, telemetry '%s')", code,
             config.telemetry_name);
    return false;
  }

  void fill(Device& device, int runlevel, int sublevel, int last_sequence, int64_t t_ns) {
    memset(state_.arm, 0, sizeof state_.arm);
    state_.runlevel = runlevel;
    state_.sublevel = sublevel;
    state_.last_seq = last_sequence;
    state_.t_ns = t_ns;
    const bool stopped = FoundArms::is_soft_stopped(device);
    for (int a = 0; a < FoundArms::kCount; ++a) {
      if (const Mechanism* own = arms_.mechanism(device, a)) fill_joints(*own, state_.arm[a]);
      if (const Mechanism* posed = arms_.posed(device, a)) fill_pose(*posed, state_.arm[a]);
      if (stopped) state_.arm[a].joints_ready = 0;
    }
  }

  // The desired joints and the poses of the calibrated arm as they would be published without the
  // correction, which is how training saw them.
  void take_correction_out() {
    ravencal_arm& arm = state_.arm[0];
    float desired_ji[RAVENCAL_JOINTS];
    memcpy(desired_ji, arm.jpos_d_ji, sizeof desired_ji);
    api_->uncorrect_desired(instance_, desired_ji, arm.jpos_d_ji);
    for (int a = 0; a < FoundArms::kCount; ++a) {
      if (!arms_.pose_is_of_calibrated(a)) continue;
      ravencal_arm& posed = state_.arm[a];
      api_->uncorrect_pose(instance_, arm.jpos_ji, uncorrected_ji_, posed.pos_um, posed.ori);
      api_->uncorrect_pose(instance_, desired_ji, arm.jpos_d_ji, posed.pos_d_um, posed.ori_d);
    }
    memcpy(arm.jpos_ji, uncorrected_ji_, sizeof uncorrected_ji_);
  }

  void move_desired_pose(Mechanism& mechanism, const float (&from_ji)[RAVENCAL_JOINTS],
                         const float (&to_ji)[RAVENCAL_JOINTS]) {
    int32_t position_um[3] = {mechanism.pos_d.x, mechanism.pos_d.y, mechanism.pos_d.z};
    float rotation[9];
    memcpy(rotation, mechanism.ori_d.R, sizeof rotation);
    api_->uncorrect_pose(instance_, from_ji, to_ji, position_um, rotation);
    mechanism.pos_d.x = position_um[0];
    mechanism.pos_d.y = position_um[1];
    mechanism.pos_d.z = position_um[2];
    memcpy(mechanism.ori_d.R, rotation, sizeof rotation);
  }

  static void fill_joints(const Mechanism& mechanism, ravencal_arm& arm) {
    for (int i = 0; i < RAVENCAL_SLOTS; ++i) {
      const Joint& joint = mechanism.joint[i];
      const int slot = FoundArms::slot_of(joint);
      arm.enc_counts[slot] = joint.enc_val;
      arm.enc_offset_counts[slot] = joint.enc_offset;
      arm.dac_counts[slot] = joint.current_cmd;
      arm.tau_n_m[slot] = joint.tau_d;
      arm.mpos_rad[slot] = joint.mpos;
      arm.mpos_d_rad[slot] = joint.mpos_d;
      arm.mvel_rad_per_s[slot] = joint.mvel;
      arm.jpos_ji[slot] = joint.jpos;
      arm.jpos_d_ji[slot] = joint.jpos_d;
      arm.jvel_ji[slot] = joint.jvel;
      if (FoundArms::is_ready(joint)) arm.joints_ready |= 1U << slot;
    }
  }

  static void fill_pose(const Mechanism& mechanism, ravencal_arm& arm) {
    arm.type = mechanism.type;
    arm.pos_um[0] = mechanism.pos.x;
    arm.pos_um[1] = mechanism.pos.y;
    arm.pos_um[2] = mechanism.pos.z;
    arm.pos_d_um[0] = mechanism.pos_d.x;
    arm.pos_d_um[1] = mechanism.pos_d.y;
    arm.pos_d_um[2] = mechanism.pos_d.z;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        arm.ori[3 * row + column] = mechanism.ori.R[row][column];
        arm.ori_d[3 * row + column] = mechanism.ori_d.R[row][column];
      }
    }
    arm.grasp_d_rad = static_cast<float>(mechanism.ori_d.grasp) / 1000.0F;  // held in mrad
  }

  static void fill_jacobian(Mechanism& mechanism, ravencal_arm& arm) {
    Jacobian::read(mechanism, arm.jac_vel);
    memcpy(arm.jac_f, arm.jac_vel, sizeof arm.jac_f);
  }

  void* library_;
  const ravencal_api* api_;
  ravencal_instance* instance_;
  void* storage_;
  ControllerSettings settings_;
  ravencal_state state_;
  ravencal_output output_;
  FoundArms arms_;
  float uncorrected_ji_[RAVENCAL_JOINTS];  // jpos of the calibrated arm at the hook
  float saved_ji_[RAVENCAL_JOINTS];        // jpos_d between uncorrect and restore
  int saved_;
  char error_[256];
};

// For the length of a scope, jpos_d without the correction.
template <typename Adapter, typename Device>
class UncorrectedDesired {
 public:
  UncorrectedDesired(Adapter& adapter, Device& device) : adapter_(adapter), device_(device) {
    adapter_.uncorrect(device_);
  }
  ~UncorrectedDesired() { adapter_.restore(device_); }

 private:
  UncorrectedDesired(const UncorrectedDesired&);
  UncorrectedDesired& operator=(const UncorrectedDesired&);
  Adapter& adapter_;
  Device& device_;
};

}  // namespace ravencal

#endif  // RAVENCAL_CONTROLLER_HPP
