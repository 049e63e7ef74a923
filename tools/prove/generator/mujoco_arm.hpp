// SPDX-License-Identifier: Apache-2.0
//
// The second engine: the same chain as a MuJoCo model, whose rigid-body dynamics (composite
// inertia, recursive Newton-Euler) owe nothing to Chain's Jacobians. MuJoCo has no LuGre, no
// Bouc-Wen and no gap, so that cables and friction stay with SUNDIALS.
#pragma once

#include <memory>

#include "core/result.hpp"
#include "prove/generator/chain.hpp"

namespace ravencal::prove {

/// One instance belongs to one thread.
class MujocoArm {
 public:
  /// Errors: kData with MuJoCo's reason if it refuses the chain.
  static core::Result<MujocoArm> create(const Chain& chain);
  MujocoArm(MujocoArm&&) noexcept;
  MujocoArm& operator=(MujocoArm&&) noexcept;
  ~MujocoArm();

  [[nodiscard]] ChainDynamics at(const Vector3d& joints, const Vector3d& velocities) const;

 private:
  struct Impl;
  explicit MujocoArm(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::prove
