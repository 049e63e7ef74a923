// SPDX-License-Identifier: Apache-2.0
//
// How the controller's values answer to the correction: the servo of joints 1 to 3 as a linear
// system in discrete time, at the control rate, around a posture.
//
// The correction e (joint units) is added to the measured joints; the controller then wants the
// motors at mpos_d = C (jpos_d - e), with C from joints to motor angles (reduction and coupling).
// A change of e therefore moves, with z the shift by one control cycle of T seconds:
//
//     mpos_d = -C e
//     tau    = Kp (mpos_d - m) - Kd (1 - 1/z)/T m,     m = z^-a H(z) tau
//     so tau = -[I + (Kp + Kd (1 - 1/z)/T) z^-a H]^-1 Kp C e
//
// tau: torques at the gearbox outputs; m: motor angles that the controller reads, a cycles old. H
// is the zero-order hold equivalent (matrix exponential) of motors, cables and links,
//
//     J q'' = r tau - b q' - D' t,   M y'' = t,   t = K (D q - y) + B (D q' - y')
//
// with q the motor angles over the reduction, y the joints, J and b inertia and viscous friction of
// the motors, r joint effort per torque, D the true coupling and gain, K and B stiffness and
// damping of the cables, M the arm's mass matrix at the posture. Left out, because they only take
// energy out or are slow: dry friction, hysteresis, creep, backlash; and weight, whose stiffness is
// small beside the cable's. DAC and encoder steps and limits are left out too.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <memory>
#include <string_view>

#include "core/catalogue.hpp"
#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::loop {

using Complex = std::complex<double>;
using Response =
    Eigen::Matrix<Complex, 1, 3>;  ///< of one value to the corrections of joints 1 to 3

struct ServoOptions {
  /// Age of the encoder values at the hook. The controller starts its USB read before it sleeps, so
  /// they are one cycle old (uw-biorobotics/raven2 rt_process_preempt.cpp).
  int encoder_age_cycles = 1;
  bool coupled_joint_velocity = false;  ///< jvel as the CRTK branch computes it
};

/// Everything that depends on the posture. `at(z)` may be called for any z but 1.
class ServoLoop {
 public:
  /// Errors (kData): not the three joints of a RAVEN, a joint without controller or cable.
  static core::Result<ServoLoop> create(const physics::Plant& plant,
                                        const ServoOptions& options = {});
  ServoLoop(ServoLoop&&) noexcept;
  ServoLoop& operator=(ServoLoop&&) noexcept;
  ~ServoLoop();

  /// Linearises at these joints: rad, rad, m.
  void set_posture(const Eigen::Vector3d& joints_ji);
  [[nodiscard]] double cycle_s() const;

  /// All responses at one frequency; `is_dc`: the limit z -> 1, where the motors have followed.
  void set_frequency(Complex z, bool is_dc = false);
  /// Response, as the plugin sees it at its hook, of a raven_state value of this arm: SI unit per
  /// joint unit. Zero for values that do not answer (see answers()).
  [[nodiscard]] Response of(core::RavenField field, std::size_t element) const;

 private:
  struct Impl;
  explicit ServoLoop(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// How a channel of this name is treated.
enum class Answer {
  kNone,  ///< it does not answer to the correction
  kModelled,
  kUnknown,  ///< it answers, but no formula is known: jac_vel and jac_f
};
Answer answer_of(std::string_view channel);

}  // namespace ravencal::loop
