// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::physics {

/// Slow yielding of the cable (standard linear solid, one time constant): the extension follows
/// effort * compliance with time constant `time_s`, and recovers without load. Units: the joint's.
class Creep {
 public:
  Creep() = default;
  Creep(double compliance, double time_s) : compliance_(compliance), rate_hz_(1.0 / time_s) {}

  /// Extension after `dt_s` under `effort`; implicit, stable for any step.
  double step(double effort, double dt_s) {
    const double gain = rate_hz_ * dt_s;
    extension_ = (extension_ + gain * compliance_ * effort) / (1.0 + gain);
    return extension_;
  }

  [[nodiscard]] double extension() const { return extension_; }

 private:
  double compliance_ = 0.0;
  double rate_hz_ = 0.0;
  double extension_ = 0.0;
};

}  // namespace ravencal::physics
