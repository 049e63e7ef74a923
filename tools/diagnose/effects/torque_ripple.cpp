// SPDX-License-Identifier: Apache-2.0
//
// Cogging and ripple: the drive's effort waves over its position.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class TorqueRipple final : public EffectForm {
 public:
  TorqueRipple() : EffectForm("torque_ripple") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 4 && range_of(s, s.motion.q) > 100.0 * s.rest_width()
               ? ""
               : "too few passes over a long enough range";
  }
  std::vector<Shape> grid(const Series& s) const override {
    const double range = range_of(s, s.motion.q);
    constexpr double kTurn = 2.0 * 3.14159265358979323846;
    return log_grid(4.0 * kTurn / range, 40.0 * kTurn / range, 32);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    Eigen::MatrixXd out(s.rows(), 2);
    out.col(0) = (shape[0] * s.motion.q.array()).sin();
    out.col(1) = (shape[0] * s.motion.q.array()).cos();
    return out;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"amplitude", b.norm(), amplitude_unit(s)},
            {"order", shape[0], s.prismatic ? "rad_per_m" : "1"},
            {"phase", std::atan2(b[1], b[0]), "rad"}};
  }
  std::string separate_by() const override {
    return "pass the range slowly both ways at 1 kHz: ripple repeats with the motor's poles";
  }
};

}  // namespace

std::unique_ptr<EffectForm> torque_ripple() { return std::make_unique<TorqueRipple>(); }

}  // namespace ravencal::diagnose
