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
    return shows_waves(s) ? "" : "too few passes over a long enough range";
  }
  std::vector<Shape> grid(const Series& s) const override { return wave_orders(s, 2.0, 40.0, 42); }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return wave_columns(s, shape);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return wave_parameters(s, shape, b);
  }
  std::string separate_by() const override {
    return "pass the range slowly both ways at 1 kHz: ripple repeats with the motor's poles";
  }
};

}  // namespace

std::unique_ptr<EffectForm> torque_ripple() { return std::make_unique<TorqueRipple>(); }

}  // namespace ravencal::diagnose
