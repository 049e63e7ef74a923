// SPDX-License-Identifier: Apache-2.0
//
// Recordings with known physics for the tests of diagnose. It shares no code with shared/physics or
// tools/diagnose: its own motion, bristle friction, gap and coloured noise, so that a test is not
// graded by its author.
#pragma once

#include <cstdint>
#include <string>

#include "record/recording.hpp"

namespace ravencal::generator {

/// What joint "one" really does; joint "two" only moves. Zero: absent.
struct HiddenPhysics {
  double offset_rad = 0.0;
  double gain = 0.0;
  double coupling = 0.0;  ///< rad of "one" per rad of "two"
  double gap_half_rad = 0.0;
  double delay_s = 0.0;   ///< of the truth behind the estimate
  double slip_rad = 0.0;  ///< at half time
  double bump_rad = 0.0;  ///< outside the vocabulary: a hill over a tenth of the range
  double wave_rad = 0.0;  ///< of wave_order over the position
  double wave_order = 0.0;
  double coulomb_n_m = 0.0;
  double viscous_n_m_s = 0.0;
  double inertia_kg_m2 = 2.0;
};

struct Scene {
  std::uint64_t seed = 1;
  double duration_s = 400.0;
  double rate_hz = 25.0;
  double noise = 1.0;  ///< scale of all noise
  bool with_truth = true;
  bool with_torque = true;
};

/// Two joints on random zig-zags between -0.5 and 0.5 rad.
record::Recording make_recording(const HiddenPhysics& hidden, const Scene& scene);

/// A plant of the two joints; `effects` is TOML inside joint "one".
std::string plant_text(const std::string& effects = {});

}  // namespace ravencal::generator
