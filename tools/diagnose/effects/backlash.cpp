// SPDX-License-Identifier: Apache-2.0
//
// A gap between drive and joint. Where the plant knows the load on the cable, the joint lies on the
// side to which the load pulls and crosses the gap where the load changes its sign. Where friction
// is all the load there is, that happens at reversals: the joint follows the drive as a play
// operator of the drive's motion, so that height and width of the loop are one number.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Backlash final : public EffectForm {
 public:
  explicit Backlash(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (replayed(s)) {
      const auto [least, greatest] = s.training_range(s.transmitted);
      if (least * greatest > 0.0) {
        return "the load on the cable never changes its sign, so that a gap stays closed on one "
               "side";
      }
      return crossings(s) >= 6 ? "" : "the load on the cable changes its sign fewer than six times";
    }
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    if (replayed(s)) return log_grid(s.rest_width(), 0.1 * range_of(s, s.motion.q), 7);
    return log_grid(2.0 * s.rest_width(),
                    std::max(4.0 * s.rest_width(), 0.4 * range_of(s, s.motion.q)), 8);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (replayed(s)) {
      CableNumbers changed = s.cable;
      changed.gap_half_width += shape[0];
      return cable_change(s, changed);
    }
    return -0.5 * shape[0] * direction_memory(s.loop_motion(), shape[0], s.fresh);
  }
  bool unit_coefficient(const Series& s) const override { return replayed(s); }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    const double width = replayed(s) ? shape[0] : 0.5 * shape[0];
    return {{"half_width", width * b[0], position_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    // A gap's loop is as wide as it is high; a third is what noise and sampling blur.
    return b[0] > 0.67 && b[0] < 1.5 ? ""
                                     : "a gap's loop is as wide as it is high; this one is not";
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (replayed(s)) return {};
    return {"joint_friction"};
  }
  std::string separate_by() const override {
    return "press the joint to and fro by hand or with torque pulses below breakaway: a gap moves "
           "without effort, friction behind a cable does not";
  }

 private:
  static int crossings(const Series& s) {
    int count = 0;
    double last = 0.0;
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      if (!s.trains(i) || s.transmitted[i] == 0.0) continue;
      count += last * s.transmitted[i] < 0.0 ? 1 : 0;
      last = s.transmitted[i];
    }
    return count;
  }
};

class BacklashKind final : public EffectKind {
 public:
  BacklashKind()
      : EffectKind("backlash", Stage::kTransmission,
                   {.probes = Probe::kLoaded | Probe::kReversals | Probe::kPressed,
                    .cable = CablePart::kGap,
                    .follows_joint = true}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<Backlash>(*this));
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (builder.in(Stage::kTransmission))
      builder.of_cable(*this, "half_width", position_unit(s), s.cable.gap_half_width,
                       [](CableNumbers& n, double f) { n.gap_half_width *= f; });
  }
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"half_width"});
  }
};

}  // namespace

const EffectKind& backlash_kind() {
  static const BacklashKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
