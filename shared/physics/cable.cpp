// SPDX-License-Identifier: Apache-2.0
#include "physics/cable.hpp"

#include <fmt/format.h>

#include <cmath>

#include "physics/effects/backlash.hpp"
#include "physics/effects/thermal_drift.hpp"

namespace ravencal::physics {

core::Result<Cable> Cable::create(const Joint& joint) {
  Cable cable;
  cable.stiffness_ = joint.parameter("compliance", "stiffness");
  cable.damping_ = joint.parameter("compliance", "damping");
  if (!(cable.stiffness_ > 0.0)) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("joint '{}' needs effect 'compliance' with a stiffness above zero: "
                    "the twin simulates its cable",
                    joint.name)};
  }
  cable.gap_half_width_ = joint.parameter("backlash", "half_width");
  cable.eccentricity_ = Eccentricity(joint);
  cable.drift_final_ = joint.parameter("thermal_drift", "final");
  cable.drift_time_s_ = joint.parameter("thermal_drift", "time");
  cable.wander_ = Wander(joint.parameter("thermal_drift", "wander"),
                         std::max(1e-3, joint.parameter("thermal_drift", "wander_time")));
  cable.hysteresis_ = Hysteresis(joint.parameter("hysteresis", "stiffness"),
                                 joint.parameter("hysteresis", "yield"));
  if (joint.find_effect("creep") != nullptr) {
    cable.has_creep_ = true;
    cable.creep_ = Creep(joint.parameter("creep", "compliance"),
                         std::max(1e-3, joint.parameter("creep", "time")));
  }
  return cable;
}

void Cable::advance_length(double dt_s, double age_s, bool with_drift, core::Random& random) {
  length_change_ = wander_.step(dt_s, random);
  if (with_drift) length_change_ += thermal_drift(drift_final_, drift_time_s_, age_s);
}

void Cable::restart_wander(core::Random& random) { wander_.restart(random); }

double Cable::step(double drive, double drive_velocity, double joint, double joint_velocity,
                   double dt_s) {
  const double elastic = drive + length_change_ - joint - creep_.extension();
  const double stretch = through_gap(elastic, gap_half_width_);
  if (!started_) last_stretch_ = stretch;
  started_ = true;
  const double spring = stiffness_ * stretch + hysteresis_.step(stretch - last_stretch_);
  last_stretch_ = stretch;
  if (has_creep_) creep_.step(spring, dt_s);
  const bool taut = gap_half_width_ == 0.0 || stretch != 0.0;
  return spring + (taut ? damping_ * (drive_velocity - joint_velocity) : 0.0);
}

}  // namespace ravencal::physics
