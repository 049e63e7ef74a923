// SPDX-License-Identifier: Apache-2.0
//
// The transmission with the recorded motion of its motor forced in: where does the joint go? A
// quasi-static replay of spring, gap, strands, creep and friction behind the cable, which balances
// efforts at every sample. Rate enters through creep and the cable's damping. Units of the joint.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// The cable's numbers, as far as they act quasi-statically.
struct CableNumbers {
  double compliance = 0.0;        ///< 1 / stiffness; 0: the cable is taken as stiff
  double damping = 0.0;           ///< effort per rate of the spring's stretch
  double gap_half_width = 0.0;    ///< position
  double strand_stiffness = 0.0;  ///< all strands together while none slips
  double strand_yield = 0.0;      ///< stretch at which the last of them slips
  double strand_openness = 0.0;   ///< share of them whose loops do not close, as Dahl's
  /// Share of their limits to which strands were loaded where a start is, in [-1, 1].
  double strand_start = 0.0;
  double creep_compliance = 0.0;
  double creep_time_s = 1.0;
  double creep_start = 1.0;          ///< share of its equilibrium that creep has where a start is
  double friction_level = 0.0;       ///< behind the cable
  double friction_load_share = 0.0;  ///< of the load, on top
  double friction_presliding = 0.0;  ///< deflection over which it builds up
  /// Side it was left on where a start is, in [-1, 1]; without one the joint sagged from where the
  /// motor stands.
  std::optional<double> friction_start{};
  double weight_scale = 1.0;

  /// True if nothing here lets joint and motor part.
  [[nodiscard]] bool rigid() const {
    return compliance <= 0.0 && gap_half_width <= 0.0 && creep_compliance <= 0.0;
  }
};

CableNumbers cable_numbers(const physics::Joint& joint);

/// What the replay needs of a series; `weight` may be empty (no load but friction and inertia).
struct CableDrive {
  const Eigen::VectorXd& t_s;
  const Eigen::VectorXd& motor;  ///< position that the motor asks of the joint
  const Eigen::VectorXd& weight;
  const Eigen::VectorXd& inertial;  ///< link inertia times acceleration; may be empty
  const std::vector<char>& fresh;
  double rest_width = 1e-9;  ///< below which motion is noise
};

struct CableMotion {
  Eigen::VectorXd stretch;  ///< motor minus joint
  Eigen::VectorXd tension;  ///< effort through the cable
};

CableMotion replay_cable(const CableDrive& drive, const CableNumbers& numbers);

/// Effort of the friction behind the cable alone along a position without gaps.
Eigen::VectorXd cable_friction(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                               const std::vector<char>& fresh, const CableNumbers& numbers);

}  // namespace ravencal::diagnose
