// SPDX-License-Identifier: Apache-2.0
//
// Friction grows with the effort that passes through gears or over pulleys (Euler and Eytelwein;
// Duclusaud et al., ICRA 2025, model M3). The effort is the one that the plant's mass and weight
// ask for and the friction behind the cable adds to, never the recorded one.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

/// The motor's own inertia is on the other side of the gears.
const Eigen::VectorXd& passed_on(const Series& s) {
  return s.transmitted.size() > 0 ? s.transmitted : s.weight;
}

class LoadDependentFriction final : public EffectForm {
 public:
  LoadDependentFriction() : EffectForm("load_dependent_friction") {}
  std::string untestable(const Series& s) const override {
    if (s.weight.size() == 0) return "the plant's links have no weight, so the load is not known";
    const double change = range_of(s, s.weight.cwiseAbs());
    return change > 0.2 * s.weight.cwiseAbs().maxCoeff() ? "" : "the load hardly changes";
  }
  // A weight that the plant lacks rubs as well: the shape is its mass, from next to nothing on.
  std::vector<Shape> grid(const Series& s) const override {
    if (s.payload_per_kg.size() == 0) return {{}};
    return log_grid(0.01, 2.0, 7);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    Eigen::VectorXd load = passed_on(s);
    if (!shape.empty()) load += shape[0] * s.payload_per_kg;
    return bristle_side(s.motion.q, s.friction_displacement(), s.fresh)
        .cwiseProduct(load.cwiseAbs());
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"load_share", b[0], "1"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 && b[0] < 1.0 ? "" : "friction cannot fall with load nor exceed it";
  }
  std::string separate_by() const override {
    return "the same motion with 0, 250 and 500 g on the tool";
  }
};

}  // namespace

std::unique_ptr<EffectForm> load_dependent_friction() {
  return std::make_unique<LoadDependentFriction>();
}

}  // namespace ravencal::diagnose
