// SPDX-License-Identifier: Apache-2.0
//
// Source of robot states for the host's loop: the digital twin, live, or a recording. One
// cycle is begin (the state at the plugin's hook), then end (the state as published). Both run in
// the loop's thread: they neither allocate nor call the system.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "physics/plant.hpp"
#include "ravencal/plugin.h"
#include "record/recording.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::host {

/// Joints 1 to 3: rad, rad, m.
using Joints = std::array<double, RAVENCAL_JOINTS>;

class RobotSource {
 public:
  virtual ~RobotSource() = default;

  /// "gold" or "green"; empty where it is not known.
  [[nodiscard]] virtual std::string arm() const { return {}; }
  /// Control cycles that it can give.
  [[nodiscard]] virtual std::int64_t cycles() const = 0;
  /// Time that no cycle stands for, since nothing is known of the robot then.
  [[nodiscard]] virtual std::int64_t skipped_ns() const { return 0; }
  /// The robot where its motion begins, as published before the first cycle; `state.t_ns` is that
  /// of the first cycle.
  virtual void rest(ravencal_state& state) = 0;
  /// What is visible at the hook of this cycle. Called once per cycle, in order.
  virtual void begin(ravencal_state& state) = 0;
  /// What the controller publishes at the end of this cycle.
  virtual void end(ravencal_state& state) = 0;
  /// True joints of this cycle, valid between begin and end; NaN where unknown.
  [[nodiscard]] virtual Joints truth_ji() const = 0;
};

struct TwinSourceOptions {
  std::uint64_t seed = 1;
  std::uint64_t homing_seed = 1;
};

/// The twin, homed and moved to the trajectory's start; one cycle per millisecond from there.
core::Result<std::unique_ptr<RobotSource>> make_twin_source(
    const physics::Plant& plant, const trajectory::Trajectory& trajectory,
    const TwinSourceOptions& options);

/// A recording with raven2 channels, each row held until the next, for a second at most: the rest
/// of a gap is skipped. Refuses a recording without a channel that one of `features` needs.
core::Result<std::unique_ptr<RobotSource>> make_recording_source(
    const record::Recording& recording, std::span<const model::FeatureSpec> features);

}  // namespace ravencal::host
