// SPDX-License-Identifier: Apache-2.0
//
// A gap between drive and joint: the joint follows the drive as a play operator of the drive's
// motion, so amplitude and width of the loop are one number.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Backlash final : public EffectForm {
 public:
  Backlash() : EffectForm("backlash") {}
  std::string untestable(const Series& s) const override {
    if (s.weight.size() > 0) {
      const auto [least, greatest] = s.training_range(s.weight);
      if (least * greatest > 0.0) {
        return "the joint's weight never changes its sign, so that a gap stays closed on one side";
      }
    }
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    return log_grid(2.0 * s.rest_width(),
                    std::max(4.0 * s.rest_width(), 0.4 * range_of(s, s.motion.q)), 8);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return -0.5 * shape[0] * direction_memory(s.motion.q, shape[0], s.fresh);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"half_width", 0.5 * shape[0] * b[0], position_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    // A gap's loop is as wide as it is high; a third is what noise and sampling blur.
    return b[0] > 0.67 && b[0] < 1.5 ? ""
                                     : "a gap's loop is as wide as it is high; this one is not";
  }
  std::vector<std::string> twins(const Series&) const override { return {"joint_friction"}; }
  std::string separate_by() const override {
    return "press the joint to and fro by hand or with torque pulses below breakaway: a gap moves "
           "without effort, friction behind a cable does not";
  }
};

}  // namespace

std::unique_ptr<EffectForm> backlash() { return std::make_unique<Backlash>(); }

}  // namespace ravencal::diagnose
