// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string_view>

#include "diagnose/vocabulary/scales.hpp"

namespace ravencal::diagnose {
namespace {

/// What a recording or a plant lacks where it is true.
struct Lack {
  std::string_view id;
  bool (*lacks)(const Scales& scales, const physics::Plant& plant);
  std::string_view because;
  bool by_recording = true;  ///< another recording could lack it no more
};

bool no_load(const Scales& s, const physics::Plant& plant) {
  return s.weight_load <= 0.0 && plant.joints[s.joint].parameter("joint_friction", "level") <= 0.0;
}
bool no_known_load(const Scales& s, const physics::Plant&) { return s.weight_load <= 0.0; }
bool no_weight(const Scales& s, const physics::Plant&) { return !s.weight; }
bool no_frame(const Scales& s, const physics::Plant& plant) {
  return !plant.joints[s.joint].frame.has_value();
}
/// Key of a tolerance without which the number counts as exact.
template <char const* kKey>
bool no_tolerance(const Scales& s, const physics::Plant& plant) {
  return !plant.joints[s.joint].tolerance.contains(kKey);
}
bool no_law(const Scales& s, const physics::Plant&) { return !s.law; }
bool no_yielding_cable(const Scales& s, const physics::Plant& plant) {
  const physics::Joint& joint = plant.joints[s.joint];
  return joint.parameter("compliance", "stiffness") <= 0.0 &&
         joint.parameter("backlash", "half_width") <= 0.0;
}
bool no_speed(const Scales& s, const physics::Plant&) { return !s.moves; }
bool no_friction(const Scales& s, const physics::Plant& plant) {
  return plant.joints[s.joint].parameter("coulomb_friction", "level") <= 0.0;
}
bool followed(const Scales& s, const physics::Plant&) { return s.followed; }
bool always(const Scales&, const physics::Plant&) { return true; }

constexpr std::string_view kRests = "the recordings consist of rests, which show no speed";
constexpr std::string_view kNoFrame =
    "the plant does not state where its joints stand ([joint.frame])";
constexpr std::string_view kExact =
    "the plant states no tolerance of it ([joint.tolerance]), so that it counts as exact";
constexpr std::string_view kNoLever =
    "no effort that was recorded depends on it: record the place of the tool's tip";

constexpr char kLength[] = "link_length", kAxial[] = "link_axial", kAcross[] = "link_across",
               kZero[] = "joint_zero";

constexpr std::array kLacks = {
    Lack{"compliance", no_load, "the load on this joint never changes"},
    Lack{"creep", no_load, "the load on this joint never changes"},
    Lack{"viscous_friction", no_speed, kRests},
    Lack{"stribeck_friction", no_speed, kRests},
    Lack{"inertia_error", no_speed, kRests},
    Lack{"load_dependent_friction", no_known_load,
         "the plant's links have no weight, so the load is not known", false},
    Lack{"gravity", no_known_load, "the plant's links have no weight, so the load is not known",
         false},
    Lack{"eccentricity", always, "not one period of any pulley was passed"},
    Lack{"torque_ripple", always, "not one period of any pulley was passed"},
    Lack{"payload", no_weight, "the plant does not say where a payload would hang", false},
    Lack{"link_length", no_frame, kNoFrame, false},
    Lack{"link_axial", no_frame, kNoFrame, false},
    Lack{"link_across", no_frame, kNoFrame, false},
    Lack{"joint_zero", no_frame, kNoFrame, false},
    Lack{"centre_of_mass", no_frame, kNoFrame, false},
    Lack{"centre_of_mass", always,
         "no effort that was recorded depends on it: move the joints that carry the link"},
    Lack{kLength, no_tolerance<kLength>, kExact, false},
    Lack{kAxial, no_tolerance<kAxial>, kExact, false},
    Lack{kAcross, no_tolerance<kAcross>, kExact, false},
    Lack{kZero, no_tolerance<kZero>, kExact, false},
    Lack{"link_length", always, kNoLever, false},
    Lack{"link_axial", always, kNoLever, false},
    Lack{"link_across", always, kNoLever, false},
    Lack{"joint_zero", always, kNoLever, false},
    Lack{"torque_constant", followed,
         "no effort was recorded, so the controller's gains stand for it: record the effort"},
    Lack{"saturation", followed,
         "no effort was recorded: a limit shows where less is delivered than was asked for"},
    Lack{"saturation", no_law,
         "record the desired position, and state the controller in the plant: a limit shows where "
         "less is delivered than was asked for"},
    Lack{"controller_gain", no_law,
         "the recording or the plant lacks the command's inputs, its output or its control law"},
    Lack{"input_disturbance", no_law,
         "the recording or the plant lacks the command's inputs, its output or its control law"},
    Lack{"input_disturbance", always,
         "looked for at every moment that was recorded, and none holds", false},
    Lack{"joint_friction", no_yielding_cable,
         "the plant's cable does not yield, so friction behind it is friction of the drive", false},
    Lack{"presliding", no_friction, "the plant has no dry friction that could build up", false},
    Lack{"quantisation", always,
         "channels are compared through a filter of 0.1 s, which leaves no steps of an encoder",
         false},
    Lack{"flexible_mode", always,
         "channels are compared below 3 Hz, where links do not ring on their cables", false},
};

}  // namespace

Untestable why_untestable(const std::string& id, const Scales& scales,
                          const physics::Plant& plant) {
  for (const Lack& lack : kLacks)
    if (lack.id == id && lack.lacks(scales, plant))
      return {std::string(lack.because), lack.by_recording};
  return {};
}

}  // namespace ravencal::diagnose
