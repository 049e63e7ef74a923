// SPDX-License-Identifier: Apache-2.0
//
// Motors, cables and links of joints 1 to 3, integrated at the plant's inner rate: what happens
// between the DAC and the encoders. Nothing here knows the controller.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "core/random.hpp"
#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

class ArmPhysics {
 public:
  /// `with_drift` adds the slow warm-up part of `thermal_drift`.
  static core::Result<ArmPhysics> create(const Plant& plant, bool with_drift);
  ArmPhysics(ArmPhysics&&) noexcept;
  ArmPhysics& operator=(ArmPhysics&&) noexcept;
  ArmPhysics(const ArmPhysics&) = delete;
  ArmPhysics& operator=(const ArmPhysics&) = delete;
  ~ArmPhysics();

  /// Puts joints and unloaded cables at a position, at rest.
  void place(const Eigen::Vector3d& joints_ji);
  /// Draws where the hard stops seat this time.
  void draw_stop_seats(core::Random& random);
  /// Draws the slow disturbances afresh from their stationary distributions.
  void restart_disturbances(core::Random& random);
  /// One control cycle under constant torques at the gearbox outputs, [3] N m.
  void advance(const Eigen::Vector3d& torque_n_m, core::Random& random);

  [[nodiscard]] const Eigen::Vector3d& motors_rad() const;  ///< motor shafts, [3]
  [[nodiscard]] const Eigen::Vector3d& joints_ji() const;   ///< true joints, rad rad m
  /// Kinetic energy of motors and links, J.
  [[nodiscard]] double kinetic_energy_j() const;

 private:
  struct Impl;
  explicit ArmPhysics(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::physics
