// SPDX-License-Identifier: Apache-2.0
//
// Friction yields elastically before it slips (Dahl): after a reversal the friction effort turns
// over a displacement instead of at once. The column is what that changes against sharp Coulomb
// friction.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Presliding final : public EffectForm {
 public:
  Presliding() : EffectForm("presliding") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    // Without a cable in the plant, its wind-up under friction turns over a displacement too.
    const double reach = s.cable.compliance > 0.0 ? 0.05 : 0.2;
    return log_grid(3.0 * s.rest_width(),
                    std::max(6.0 * s.rest_width(), reach * range_of(s, s.motion.q)), 6);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return bristle_side(s.motion.q, 0.5 * shape[0], s.fresh) -
           bristle_side(s.motion.q, s.friction_displacement(), s.fresh);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"level", b[0], amplitude_unit(s)}, {"displacement", 0.5 * shape[0], position_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would overshoot after a reversal";
  }
  std::string prerequisite() const override { return "coulomb_friction"; }
  std::string separate_by() const override {
    return "reversals of 0.05, 0.2 and 1 degree around one pose";
  }
};

}  // namespace

std::unique_ptr<EffectForm> presliding() { return std::make_unique<Presliding>(); }

}  // namespace ravencal::diagnose
