// SPDX-License-Identifier: Apache-2.0
//
// The transmission of one joint behind the motor: cable stretch with its history (spring, gap,
// strand hysteresis, creep), pulley run-out and slow change of length. Every part is absent unless
// the plant names its effect; without `compliance` there is no cable and create fails.
#pragma once

#include "core/random.hpp"
#include "core/result.hpp"
#include "physics/effects/creep.hpp"
#include "physics/effects/eccentricity.hpp"
#include "physics/effects/hysteresis.hpp"
#include "physics/effects/wander.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Real-time safe after construction. Units: the joint's (rad, N m or m, N).
class Cable {
 public:
  static core::Result<Cable> create(const Joint& joint);

  [[nodiscard]] const Eccentricity& eccentricity() const { return eccentricity_; }

  /// Once per control cycle: slow change of length at `age_s` since power-on.
  void advance_length(double dt_s, double age_s, bool with_drift, core::Random& random);
  void restart_wander(core::Random& random);

  /// Effort on the joint (and its reaction on the drive) after one inner step. `drive` is where the
  /// drive asks the joint to be, run-out included.
  double step(double drive, double drive_velocity, double joint, double joint_velocity,
              double dt_s);

 private:
  double stiffness_ = 0.0;
  double damping_ = 0.0;
  double gap_half_width_ = 0.0;
  double drift_final_ = 0.0;
  double drift_time_s_ = 0.0;
  bool has_creep_ = false;
  bool started_ = false;
  double last_stretch_ = 0.0;
  double length_change_ = 0.0;
  Eccentricity eccentricity_;
  Hysteresis hysteresis_;
  Creep creep_;
  Wander wander_;
};

}  // namespace ravencal::physics
