// SPDX-License-Identifier: Apache-2.0
//
// The RAVEN-II digital twin: one simulated arm with everything between command and joint, cycle by
// cycle as the controller runs it. Used by `ravencal simulate` and, live, by `ravencal host`.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>

#include "core/catalogue.hpp"
#include "core/result.hpp"
#include "physics/plant.hpp"
#include "physics/raven_message.hpp"

namespace ravencal::physics {

/// What only a simulator knows, and what the external encoders say about it.
struct Truth {
  Eigen::Vector3d joints_ji = Eigen::Vector3d::Zero();  ///< true joint positions: rad, rad, m
  std::array<std::int64_t, 3> encoder_counts{};  ///< external encoders: 80000/rev, 80000/rev, 5 um
  Eigen::Vector3d encoder_ji = Eigen::Vector3d::Zero();  ///< the same as positions: rad, rad, m
};

/// What may differ between two runs of the same robot.
struct TwinOptions {
  std::uint64_t seed = 1;         ///< disturbances during the run
  std::uint64_t homing_seed = 1;  ///< power-on and homing: equal seeds, equal encoder offsets
  bool drift = false;             ///< hours of warm-up: the slow part of effect thermal_drift
};

/// One arm of the robot with its controller. A cycle is begin_cycle (sensors are read; this is the
/// plugin's hook) and end_cycle (control law, message published, 1 ms of physics). Same plant and
/// seed: same values.
class RavenTwin {
 public:
  static core::Result<RavenTwin> create(const Plant& plant, std::uint64_t seed);
  static core::Result<RavenTwin> create(const Plant& plant, const TwinOptions& options);
  RavenTwin(RavenTwin&&) noexcept;
  RavenTwin& operator=(RavenTwin&&) noexcept;
  RavenTwin(const RavenTwin&) = delete;
  RavenTwin& operator=(const RavenTwin&) = delete;
  ~RavenTwin();

  /// Runs the homing sequence to the hard stops; sets the encoder offsets with their variation.
  /// May be called again: every homing of a session seats differently. `each_cycle` is called
  /// once a control cycle, when its sensors have been read.
  void home(const std::function<void()>& each_cycle = {});
  /// The same sequence cycle by cycle, for a robot that is watched meanwhile: start_homing(), then
  /// begin_cycle() and end_homing_cycle() until homed().
  void start_homing();
  const RavenMessage& end_homing_cycle();
  /// False before home(), while homing, and after it if a joint found no stop within two minutes.
  [[nodiscard]] bool homed() const;

  /// The arm's joints as the controller believes them after homing: where desired_ji starts.
  [[nodiscard]] Eigen::Vector3d estimate_ji() const;

  /// Reads the sensors and returns what is visible at the hook: positions of this cycle, but
  /// torque, desired and pose of the cycle before, and dac = 0.
  const RavenMessage& begin_cycle();

  /// Runs the controller towards `desired_ji` (rad, rad, m) and returns the published message.
  const RavenMessage& end_cycle(const Eigen::Vector3d& desired_ji);

  /// A cycle with the brakes on, in place of end_cycle: nothing moves, the desired joints are the
  /// measured ones. `pedal_up`: else at the E-stop or initialising.
  const RavenMessage& end_braked_cycle(bool pedal_up);

  /// What the last cycle published.
  [[nodiscard]] const RavenMessage& message() const;
  /// The arm as its controller has it since the last cycle.
  [[nodiscard]] const ArmState& arm_state() const;
  /// From now on this is the other arm of the messages, instead of one parked with its brakes on.
  void show_other_arm(const ArmState& other);

  [[nodiscard]] Truth truth() const;
  [[nodiscard]] std::int64_t t_ns() const;  ///< simulated monotonic time of the current cycle

 private:
  struct Impl;
  explicit RavenTwin(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::physics
