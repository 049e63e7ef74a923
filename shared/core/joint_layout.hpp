// SPDX-License-Identifier: Apache-2.0
//
// The joints of a RAVEN-II arm, in the order and with the units that the controller uses.
// Vectors that mix radians and metres end in `_ji` ("joint SI unit"): rad, rad, m.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace ravencal::core {

/// Slots of every per-joint array in raven_state (uw-biorobotics/raven2 include/raven/defines.h).
/// Slot 3 is not connected and is called the void slot.
enum class JointSlot : std::size_t {
  kShoulder = 0,
  kElbow = 1,
  kInsertion = 2,
  kVoid = 3,
  kRoll = 4,
  kWrist = 5,
  kGrasp1 = 6,
  kGrasp2 = 7,
};

inline constexpr std::size_t kSlotCount = 8;

/// Joints 1 to 3: the ones with external encoders, which ravencal corrects.
inline constexpr std::size_t kCalibratedJointCount = 3;

inline constexpr std::array<std::string_view, kSlotCount> kSlotNames = {
    "shoulder", "elbow", "insertion", "void", "roll", "wrist", "grasp1", "grasp2"};

/// SI unit of each slot's joint position: only the insertion is prismatic.
inline constexpr std::array<std::string_view, kSlotCount> kSlotUnits = {"rad", "rad", "m",   "rad",
                                                                        "rad", "rad", "rad", "rad"};

}  // namespace ravencal::core
