// SPDX-License-Identifier: Apache-2.0
//
// Friction behind the cable holds part of the cable's stretch: after a reversal the joint waits
// until the cable has been wound from one side to the other. The loop is at least as wide as it is
// high.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class JointFriction final : public EffectForm {
 public:
  JointFriction() : EffectForm("joint_friction") {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    if (by_cable(s)) {
      const double whole = range_of(s, s.motion.q) / s.cable.compliance;
      const double least = 0.3 * s.rest_width() / s.cable.compliance;
      return log_grid(least, std::max(2.0 * least, 0.1 * whole), 7);
    }
    return log_grid(2.0 * s.rest_width(),
                    std::max(4.0 * s.rest_width(), 0.4 * range_of(s, s.motion.q)), 8);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (by_cable(s)) {
      CableNumbers changed = s.cable;
      changed.friction_level += shape[0];
      if (s.stage == Stage::kDrive) return tension_change(s, changed);
      return cable_change(s, changed);
    }
    return -direction_memory(s.loop_motion(), shape[0], s.fresh);
  }
  bool unit_coefficient(const Series& s) const override { return by_cable(s); }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    if (by_cable(s)) return {{"level", shape[0] * b[0], effort_unit(s)}};
    return {{"stretch", b[0], position_unit(s)}, {"width", shape[0], position_unit(s)}};
  }
  std::string inconsistency(const Series& s, const Shape& shape,
                            const Eigen::VectorXd& b) const override {
    if (by_cable(s))
      return b[0] > 0.67 && b[0] < 1.5 ? ""
                                       : "the loop's height does not fit the cable's stiffness";
    if (b[0] <= 0.0) return "friction would push the joint ahead of its motor";
    return 2.0 * b[0] < 1.5 * shape[0] ? "" : "the loop is higher than it is wide";
  }
  std::vector<std::string> twins(const Series& s) const override {
    if (s.weight.size() > 0) return {};
    return {"backlash"};
  }
  std::string separate_by() const override {
    return "press the joint to and fro by hand or with torque pulses below breakaway: a gap moves "
           "without effort, friction behind a cable does not";
  }

 private:
  /// The cable's stiffness is known, so that height and width of the loop follow from one level.
  static bool by_cable(const Series& s) {
    return s.cable.compliance > 0.0 && (replayed(s) || s.stage == Stage::kDrive);
  }
};

}  // namespace

std::unique_ptr<EffectForm> joint_friction() { return std::make_unique<JointFriction>(); }

}  // namespace ravencal::diagnose
