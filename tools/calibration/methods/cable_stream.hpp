// SPDX-License-Identifier: Apache-2.0
//
// A plant's cable, quasi-statically and sample by sample: the recorded motor is forced in, and
// spring, gap, strands and friction behind the cable balance the load. The same balance as
// `diagnose` replays over whole recordings, written as a stream because a control loop has one
// sample at a time. Units of the joint.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/plant.hpp"

namespace ravencal::methods {

class CableStream {
 public:
  explicit CableStream(const physics::Joint& joint)
      : stiffness_(joint.parameter("compliance", "stiffness")),
        gap_(joint.parameter("backlash", "half_width")),
        strand_stiffness_(joint.parameter("hysteresis", "stiffness") / kStrands),
        strand_yield_(joint.parameter("hysteresis", "yield")),
        creep_compliance_(joint.parameter("creep", "compliance")),
        creep_time_s_(std::max(1e-3, joint.parameter("creep", "time"))),
        friction_(joint.parameter("joint_friction", "level")),
        load_share_(joint.parameter("joint_friction", "load_share")),
        presliding_(std::max(1e-9, joint.parameter("joint_friction", "presliding"))) {}

  /// True if the plant's joint has a cable that stretches.
  [[nodiscard]] bool stretches() const { return stiffness_ > 0.0; }

  void start(double motor, double load) {
    strands_.fill(0.0);
    bristle_ = 0.0;
    stretch_ = 0.0;
    creep_ = creep_compliance_ * load;
    joint_ = motor;
    settle(motor, balance(motor, load));
  }

  /// Motor minus joint after the motor has moved to `motor` under `load`.
  double step(double motor, double load, double dt_s) {
    if (creep_compliance_ > 0.0)
      creep_ += (1.0 - std::exp(-dt_s / creep_time_s_)) * (creep_compliance_ * tension_ - creep_);
    settle(motor, balance(motor, load));
    return motor - joint_;
  }
  [[nodiscard]] double offset(double motor) const { return motor - joint_; }

 private:
  static constexpr std::size_t kStrands = 4;  // as physics::Hysteresis

  [[nodiscard]] double effort(double s) const {
    double sum = stiffness_ * (s > gap_ ? s - gap_ : (s < -gap_ ? s + gap_ : 0.0));
    for (std::size_t i = 0; i < kStrands; ++i) {
      const double limit = strand_yield_ * static_cast<double>(i + 1) / kStrands;
      sum += strand_stiffness_ * std::clamp(strands_[i] + s - stretch_, -limit, limit);
    }
    return sum;
  }

  /// Stretch at which cable, load and friction balance; their sum rises with it: bisection.
  [[nodiscard]] double balance(double motor, double load) const {
    const double level = friction_ + load_share_ * std::abs(load);
    double low = -(gap_ + (std::abs(load) + level) / stiffness_ + strand_yield_ + 1e-12);
    double high = -low;
    for (int i = 0; i < 44; ++i) {
      const double s = 0.5 * (low + high);
      const double moved = motor - creep_ - s - joint_;
      const double friction = level * std::clamp(bristle_ + moved / presliding_, -1.0, 1.0);
      (effort(s) - load - friction > 0.0 ? high : low) = s;
    }
    return 0.5 * (low + high);
  }

  void settle(double motor, double next) {
    for (std::size_t i = 0; i < kStrands; ++i) {
      const double limit = strand_yield_ * static_cast<double>(i + 1) / kStrands;
      strands_[i] = std::clamp(strands_[i] + next - stretch_, -limit, limit);
    }
    stretch_ = next;
    const double joint = motor - creep_ - stretch_;
    bristle_ = std::clamp(bristle_ + (joint - joint_) / presliding_, -1.0, 1.0);
    joint_ = joint;
    tension_ = effort(stretch_);
  }

  double stiffness_, gap_, strand_stiffness_, strand_yield_, creep_compliance_, creep_time_s_;
  double friction_, load_share_, presliding_;
  std::array<double, kStrands> strands_{};
  double bristle_ = 0.0;
  double stretch_ = 0.0;
  double creep_ = 0.0;
  double joint_ = 0.0;
  double tension_ = 0.0;
};

}  // namespace ravencal::methods
