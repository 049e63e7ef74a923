// SPDX-License-Identifier: Apache-2.0
//
// A joint as it is built: motor, cable and link as two masses, LuGre friction on both sides, a PD
// servo at 1 kHz on quantised counts with raw-difference velocity, coloured sensor noise. It shares
// no code with what it tests, and its friction, cable and noise are of another kind than the
// plant's.
#pragma once

#include <cstdint>
#include <string>

#include "record/recording.hpp"

namespace ravencal::generator {

/// What the arm really does; the plant of arm_plant() knows the first group only.
struct ArmTruth {
  double weight_n_m = 2.06, stiffness = 400.0, motor_friction = 2.5, viscous = 2.4,
         joint_friction = 0.5;
  double gap_half_rad = 0.0, gain = 0.0, delay_s = 0.0, run_out_rad = 0.0, creep = 0.0,
         strands_n_m = 0.0, strands_yield_rad = 0.004, slip_rad = 0.0, lost_rad = 0.0,
         bump_rad = 0.0, payload_kg = 0.0, offset_rad = 0.0, drift_rad = 0.0, uneven_n_m = 0.0,
         uneven_viscous = 0.0;
};

struct ArmScene {
  std::uint64_t seed = 1;
  double duration_s = 240.0;
  double rate_hz = 100.0;
  bool rich = false;        ///< holds, nested reversals and a tenfold of speeds, or a slow zig-zag
  double deviation = 0.05;  ///< of the truth's numbers from the plant's, one sigma
  double rest_s = 0.0;      ///< at rest before it moves, friction behind the cable left on one side
  double mount_rad = 0.0;   ///< from hanging to the joint's zero: loads the cable to one side
};

/// Desired position, motor position, joint truth and drive torque of the joint "elbow".
record::Recording record_arm(const ArmTruth& truth, const ArmScene& scene);

/// The plant as its owner knows it, without the effect `concealed`.
std::string arm_plant(const std::string& concealed = {}, double mount_rad = 0.0);

}  // namespace ravencal::generator
