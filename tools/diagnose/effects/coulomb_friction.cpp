// SPDX-License-Identifier: Apache-2.0
//
// Dry friction of the drive: a constant effort against the motion, held at rest.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class CoulombFriction final : public EffectForm {
 public:
  CoulombFriction() : EffectForm("coulomb_friction") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 2 ? "" : "the motion never reverses";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return s.stage == Stage::kTracking ? -direction(s) : direction(s);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    if (s.stage == Stage::kTracking) return {{"lag", b[0], amplitude_unit(s)}};
    return {{"level", b[0], amplitude_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would drive the motion";
  }
  std::string separate_by() const override {
    return "the same motion at three speeds and under two loads: dry friction is the same at all";
  }
};

}  // namespace

std::unique_ptr<EffectForm> coulomb_friction() { return std::make_unique<CoulombFriction>(); }

}  // namespace ravencal::diagnose
