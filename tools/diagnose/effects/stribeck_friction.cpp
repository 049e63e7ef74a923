// SPDX-License-Identifier: Apache-2.0
//
// Friction is higher at low speed than in full motion: extra * exp(-(v / v_s)^2) against the motion
// (Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 1994).
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class StribeckFriction final : public EffectForm {
 public:
  StribeckFriction() : EffectForm("stribeck_friction") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 4 ? "" : "the motion reverses fewer than four times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    const double v = s.training_rms(s.motion.v);
    return log_grid(0.02 * v, v, 7);
  }
  bool continuous() const override { return true; }
  /// What a little of it adds to bristles that bend at the same time: per unit, to first order.
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    constexpr double kLittle = 0.1;
    DryFriction f{s.friction_displacement(), kLittle, shape[0], FallOff::kSteep};
    const Eigen::VectorXd with = dry_friction(s, f);
    f.extra = 0.0;
    return (with - dry_friction(s, f)) / kLittle;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"extra", b[0], amplitude_unit(s)}, {"velocity", shape[0], per(position_unit(s), "s")}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would fall towards rest";
  }
  std::string prerequisite() const override { return "coulomb_friction"; }
  std::string separate_by() const override {
    return "passes at 0.1, 0.3 and 1 times the usual speed, and starts from rest";
  }
};

}  // namespace

std::unique_ptr<EffectForm> stribeck_friction() { return std::make_unique<StribeckFriction>(); }

}  // namespace ravencal::diagnose
