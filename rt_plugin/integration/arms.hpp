// SPDX-License-Identifier: Apache-2.0
//
// Which mechanism of the controller is which arm, and which of its joints is which. Arms are told
// apart when the adapter is opened, joints in every cycle: the controller sets DOF::type when its
// real-time thread starts. A template over the controller's device type, C++98; it only reads.
#ifndef RAVENCAL_ARMS_HPP
#define RAVENCAL_ARMS_HPP

#include <stddef.h>
#include <stdio.h>

#include "ravencal/plugin.h"

namespace ravencal {

// How an arm is told from the others. By mechanism::type, which is the board's serial number in the
// main branch.
struct ByType {
  template <typename Mechanism>
  static int id(const Mechanism& mechanism) {
    return static_cast<int>(mechanism.type);
  }
  static const char* what() { return "mechanism::type"; }
};

// By mechanism::name, for the CRTK branch, where arms of the same side share a type.
struct ByName {
  template <typename Mechanism>
  static int id(const Mechanism& mechanism) {
    return static_cast<int>(mechanism.name);
  }
  static const char* what() { return "mechanism::name"; }
};

// One arm, as the controller and as raven_state name it.
struct ArmSettings {
  // Main branch: GOLD_ARM or GREEN_ARM of defines.h. CRTK branch: gold or green.
  int id;
  // Slot of the arm's joints in raven_state, and of the model's training recordings: 0 gold, 1
  // green.
  int message_slot;
};

template <typename Device, typename Identity>
class Arms {
 public:
  // The controller's own types; C++98 has no decltype.
  typedef __typeof__(static_cast<Device*>(0)->mech[0]) Mechanism;
  typedef __typeof__(static_cast<Mechanism*>(0)->joint[0]) Joint;
  enum { kCalibrated = 0, kOther = 1, kCount = 2 };

  Arms() : mechanisms_(0) {}

  // Finds both arms among the first `mechanisms` of the device. `poses_as_published`: see
  // ControllerSettings. False: `error` says which arm is absent or not unique.
  bool find(const Device& device, int mechanisms, const ArmSettings& calibrated,
            const ArmSettings& other, bool poses_as_published, char* error, size_t error_bytes) {
    mechanisms_ = mechanisms;
    const ArmSettings* const arms[kCount] = {&calibrated, &other};
    for (int a = 0; a < kCount; ++a) {
      const int slot = arms[a]->message_slot;
      if (slot != 0 && slot != 1) {
        snprintf(error, error_bytes, "message_slot is %d; it is 0 (gold) or 1 (green)", slot);
        return false;
      }
      slots_[a] = slot;
      if (!find_one(device, arms[a]->id, places_[a], error, error_bytes)) return false;
      poses_[a] = places_[a];
      if (poses_as_published) poses_[a] = slot < mechanisms_ ? slot : static_cast<int>(kAbsent);
    }
    if (slots_[kCalibrated] == slots_[kOther]) {
      snprintf(error, error_bytes, "both arms have message_slot %d; one is gold's, one is green's",
               slots_[kOther]);
      return false;
    }
    if (places_[kCalibrated] == places_[kOther] && places_[kOther] != kAbsent) {
      snprintf(error, error_bytes, "both arms are mech[%d], which has %s %d", places_[kOther],
               Identity::what(), calibrated.id);
      return false;
    }
    if (places_[kCalibrated] != kAbsent) return agree(device, error, error_bytes);
    snprintf(error, error_bytes, "none of the %d mechanisms has %s %d, the calibrated arm's",
             mechanisms_, Identity::what(), calibrated.id);
    return false;
  }

  // Whether the joints of each arm are those of its message slot, as far as they have types yet.
  bool agree(const Device& device, char* error, size_t error_bytes) const {
    for (int a = 0; a < kCount; ++a) {
      if (places_[a] == kAbsent || !has_joint_types(device.mech[places_[a]])) continue;
      const int slot = slot_of_arm(device.mech[places_[a]]);
      if (slot == slots_[a]) continue;
      snprintf(error, error_bytes,
               "mech[%d] (%s %d) has message_slot %d, but its joints are published in slot %d",
               places_[a], Identity::what(), Identity::id(device.mech[places_[a]]), slots_[a],
               slot);
      return false;
    }
    return true;
  }

  // Mechanism of an arm; null if it is absent, before its joints have types, and where these are of
  // another message slot.
  const Mechanism* mechanism(const Device& device, int arm) const {
    return is_known(device, arm) ? &device.mech[places_[arm]] : 0;
  }

  // Mechanism whose pose raven_state has in an arm's slots; null if there is none.
  Mechanism* posed(Device& device, int arm) const {
    return poses_[arm] == kAbsent ? 0 : &device.mech[poses_[arm]];
  }
  bool pose_is_of_calibrated(int arm) const { return poses_[arm] == places_[kCalibrated]; }

  // The calibrated arm's, whose desired pose is compared from cycle to cycle.
  Mechanism& calibrated(Device& device) const { return device.mech[places_[kCalibrated]]; }

  // Of the calibrated arm; null where mechanism() is.
  Joint* joint(Device& device, int slot) const {
    if (!is_known(device, kCalibrated)) return 0;
    Mechanism& mechanism = device.mech[places_[kCalibrated]];
    for (int i = 0; i < RAVENCAL_SLOTS; ++i) {
      if (slot_of(mechanism.joint[i]) == slot) return &mechanism.joint[i];
    }
    return 0;
  }

  // DOF::type counts the joints of all arms, eight for each.
  static int slot_of(const Joint& joint) { return static_cast<int>(joint.type) % RAVENCAL_SLOTS; }

  static bool is_ready(const Joint& joint) { return static_cast<int>(joint.state) == kJointReady; }

  bool all_joints_ready(const Device& device) const {
    for (int i = 0; i < mechanisms_; ++i) {
      for (int j = 0; j < RAVENCAL_SLOTS; ++j) {
        if (j != kVoidIndex && !is_ready(device.mech[i].joint[j])) return false;
      }
    }
    return true;
  }

  // A soft emergency stop takes the current from every motor of every arm, and marks one joint.
  static bool is_soft_stopped(const Device& device) {
    return static_cast<int>(device.mech[0].joint[0].state) == kPositionUnknown;
  }

 private:
  enum { kPositionUnknown = 1, kJointReady = 4 };  // jointState of the controller's DS0.h
  enum { kVoidIndex = 3 };                         // NO_CONNECTION of its defines.h
  enum { kAbsent = -1 };

  bool find_one(const Device& device, int id, int& place, char* error, size_t error_bytes) const {
    place = kAbsent;
    for (int i = 0; i < mechanisms_; ++i) {
      if (Identity::id(device.mech[i]) != id) continue;
      if (place != kAbsent) {
        snprintf(error, error_bytes,
                 "%s %d belongs to mech[%d] and to mech[%d], and does not tell them apart; "
                 "ravencal::ByName does, in the CRTK branch",
                 Identity::what(), id, place, i);
        return false;
      }
      place = i;
    }
    return true;
  }

  bool is_known(const Device& device, int arm) const {
    return places_[arm] != kAbsent && has_joint_types(device.mech[places_[arm]]) &&
           slot_of_arm(device.mech[places_[arm]]) == slots_[arm];
  }
  // Gold's joints have the types 0 to 7, green's 8 to 15.
  static int slot_of_arm(const Mechanism& mechanism) {
    return static_cast<int>(mechanism.joint[0].type) / RAVENCAL_SLOTS;
  }

  // Until the controller sets them, all types are 0, and no joint can be told from another.
  static bool has_joint_types(const Mechanism& mechanism) {
    unsigned seen = 0;
    for (int i = 0; i < RAVENCAL_SLOTS; ++i) seen |= 1U << slot_of(mechanism.joint[i]);
    return seen == (1U << RAVENCAL_SLOTS) - 1U;
  }

  int mechanisms_;
  int places_[kCount];  // index into device.mech, or kAbsent
  int poses_[kCount];
  int slots_[kCount];
};

}  // namespace ravencal

#endif  // RAVENCAL_ARMS_HPP
