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
  // From sharp to yielding over a tenth of the range: real friction turns over a displacement.
  std::vector<Shape> grid(const Series& s) const override {
    const double sharp = s.rest_width();
    return log_grid(sharp, std::max(3.0 * sharp, 0.1 * range_of(s, s.drive_motion())), 6);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    // Seen as a lag it is a loop of the cable under it, which turns like play.
    if (s.stage == Stage::kTracking) return -direction_memory(s.drive_motion(), shape[0], s.fresh);
    return bristle_side(s.motion.q, 0.5 * shape[0], s.fresh);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    const std::string name = s.stage == Stage::kTracking ? "lag" : "level";
    return {{name, b[0], amplitude_unit(s)}, {"displacement", 0.5 * shape[0], position_unit(s)}};
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
