// SPDX-License-Identifier: Apache-2.0
//
// Friction differs between the two directions. Its constant part can only be told from a constant
// load if the joint also rests; its viscous part always can.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class AsymmetricFriction final : public EffectForm {
 public:
  AsymmetricFriction() : EffectForm("asymmetric_friction") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 4 ? "" : "the motion reverses fewer than four times";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return s.motion.v.cwiseAbs();
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"damping_difference", 2.0 * b[0], s.prismatic ? "N_s_per_m" : "N_m_s_per_rad"}};
  }
  std::string compares(bool /*uneven*/) const override { return "direction"; }
  std::string separate_by() const override {
    return "the same motion with the arm turned over: a load changes its sign, friction does not";
  }
};

}  // namespace

std::unique_ptr<EffectForm> asymmetric_friction() { return std::make_unique<AsymmetricFriction>(); }

}  // namespace ravencal::diagnose
