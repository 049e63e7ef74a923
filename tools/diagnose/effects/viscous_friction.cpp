// SPDX-License-Identifier: Apache-2.0
//
// Friction that grows with speed.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class ViscousFriction final : public EffectForm {
 public:
  ViscousFriction() : EffectForm("viscous_friction") {}
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override { return s.motion.v; }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"damping", b[0], s.prismatic ? "N_s_per_m" : "N_m_s_per_rad"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would drive the motion";
  }
  std::string separate_by() const override {
    return "the same motion at a third and at three times the speed";
  }
};

}  // namespace

std::unique_ptr<EffectForm> viscous_friction() { return std::make_unique<ViscousFriction>(); }

}  // namespace ravencal::diagnose
