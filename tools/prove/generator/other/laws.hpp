// SPDX-License-Identifier: Apache-2.0
//
// Laws of the other world, each as one function of its state. Quantities are joint-referred: rad
// and N m, or m and N; `effort` stands for N m or N.
//
//   dry friction     Dahl, "A solid friction model", Aerospace Corp. TOR-0158(3107-18), 1968;
//                    "Solid friction damping of mechanical vibrations", AIAA Journal 14(12), 1976
//   level over speed Hess and Soom, "Friction at a lubricated line contact operating at oscillating
//                    sliding velocities", J. Tribology 112(1), 1990
//   strands          Iwan, "A distributed-element model for hysteresis and its steady-state dynamic
//                    response", J. Applied Mechanics 33(4), 1966 (Prandtl and Ishlinskii's stops)
//   play             Hertz, "Ueber die Beruehrung fester elastischer Koerper", J. reine angew.
//   Math.
//                    92, 1882; its damping fades in as in Hunt and Crossley, "Coefficient of
//                    restitution interpreted as damping in vibroimpact", J. Applied Mechanics
//                    42(2), 1975
//   creep            two Kelvin elements: the Prony series of Findley, Lai and Onaran, "Creep and
//                    Relaxation of Nonlinear Viscoelastic Materials", North-Holland, 1976
//   saturation       Rapp, "Effects of HPA-nonlinearity on a 4-DPSK/OFDM-signal", 2nd European
//                    Conf. on Satellite Communications, 1991 (a limiter with a smooth knee)
#pragma once

#include <array>

namespace ravencal::prove {

/// Dahl's friction after `travel` more: dF/d|x| = slope |1 - F s / level|^exponent, with its sign,
/// where s is the direction of travel. Solved in closed form, so that no step is too long.
/// `level` > 0; `exponent` > 0.
double dahl_after(double effort, double level, double slope, double exponent, double travel);

/// Level at a sliding speed: coulomb + extra / (1 + (v / v_s)^2).
double hess_soom_level(double coulomb, double extra, double stribeck_velocity, double velocity);

/// Stops of equal slope whose thresholds are even over (0, 2 yield): initial slope `stiffness`,
/// saturation at `stiffness` * `yield`.
class IwanStops {
 public:
  /// Effort after `stretch` more.
  double move(double stiffness, double yield, double stretch);

 private:
  static constexpr int kCount = 10;
  std::array<double, kCount> deflection_{};
};

/// Stretch of a cable of `stiffness` behind a contact with a play of `half_width`: the contact is
/// pressed in by a tenth of the play at `usual_effort`, by the power 2/3 of the effort. `elastic`
/// counts from the middle of the play.
double stretch_behind_play(double elastic, double half_width, double stiffness,
                           double usual_effort);

/// Share of the cable's damping that acts at that stretch: 1 without a play.
double contact_share(double stretch, double half_width);

/// Two Kelvin elements of half the compliance each, a factor of root ten below and above `time_s`.
class PronyCreep {
 public:
  void step(double effort, double compliance, double time_s, double dt_s);
  [[nodiscard]] double strain() const { return fast_ + slow_; }

 private:
  double fast_ = 0.0, slow_ = 0.0;
};

/// Torque over current of a drive that saturates at `limit`; 0: never.
double soft_limit(double effort, double limit);

}  // namespace ravencal::prove
