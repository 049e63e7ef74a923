// SPDX-License-Identifier: Apache-2.0
//
// The transmission with the recorded motion of its motor forced in: where does the joint go? A
// quasi-static replay of spring, gap, strands, creep and friction behind the cable, which balances
// efforts at every sample. Rate enters through creep and the cable's damping. Units of the joint.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "physics/effects/hysteresis.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

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

CableNumbers cable_numbers(const Joint& joint);

/// What the replay takes for the least: a stiff cable and rigid friction have no balance to find.
struct CableFloors {
  double compliance = 1e-12;
  double presliding = 1e-9;
};

/// One cable, sample by sample. Allocates nothing.
class CableReplay {
 public:
  explicit CableReplay(const CableNumbers& numbers, const CableFloors& floors = {});

  /// The joint hangs where it came to rest with the motor at `motor` under `load`.
  void start(double motor, double load);

  /// Moves the motor to `motor` under `load`; returns motor minus joint.
  double step(double motor, double load, double dt_s);

  [[nodiscard]] double tension() const { return tension_; }
  [[nodiscard]] double offset(double motor) const { return motor - joint_; }

 private:
  struct Value {
    double f = 0.0;
    double slope = 0.0;
  };

  [[nodiscard]] Value elastic(double s) const;
  [[nodiscard]] double open_width() const;
  [[nodiscard]] double open_level(double moved) const;
  [[nodiscard]] Value effort(double s) const;
  [[nodiscard]] double level_at(double load) const;
  [[nodiscard]] Value imbalance(double s, double motor, double load, double level) const;
  [[nodiscard]] double balance(double motor, double load, double level) const;
  void settle(double motor, double next);

  CableNumbers n_;
  double stiffness_;
  double presliding_;
  double strand_stiffness_ = 0.0;
  double joint_ = 0.0;
  double bristle_ = 0.0;
  double creep_ = 0.0;
  double stretch_ = 0.0;
  double tension_ = 0.0;
  double elastic_ = 0.0;     ///< tension without what damping adds
  double rate_slope_ = 0.0;  ///< damping over the time since the last sample
  std::array<double, kStrands> strands_{};
  double open_ = 0.0;  ///< of the strands whose loops do not close, per their limit
};

/// What the replay needs of a recording; `weight` may be empty (no load but friction and inertia).
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

/// A whole recording; starts afresh where `fresh` is set.
CableMotion replay_cable(const CableDrive& drive, const CableNumbers& numbers);

/// Effort of the friction behind the cable alone along a position without gaps.
Eigen::VectorXd cable_friction(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                               const std::vector<char>& fresh, const CableNumbers& numbers);

}  // namespace ravencal::physics
