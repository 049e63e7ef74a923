// SPDX-License-Identifier: Apache-2.0
//
// Rate-independent memory without one sharp width: a Prandtl-Ishlinskii sum of elastic-slip
// elements. Where the plant knows the load on the cable, strands rub beside the spring and carry
// part of the load, so that the joint runs ahead of the plain spring by what they carry (Miyasaka
// et al., ICRA 2016, Bouc-Wen). Elsewhere over the joint's own motion, or over another joint's
// whose cables rub on this one's.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class HysteresisForm final : public EffectForm {
 public:
  HysteresisForm(const EffectKind& kind, const std::string& from) : EffectForm(kind, from) {}
  std::string untestable(const Series& s) const override {
    if (!from().empty())
      return range_of(s, driver(s)) > 1e-4 ? "" : "joint " + from() + " hardly moves";
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    if (by_load(s)) {
      const double stretch = range_of(s, cable_stretch(s, s.cable));
      return stretch > 0.0 ? log_grid(0.1 * stretch, stretch, 5) : std::vector<Shape>{};
    }
    const double range = range_of(s, driver(s));
    // Wider elements than a third of the range would imitate a straight line, which is coupling or
    // gain.
    return log_grid(0.004 * range, 0.1 * range, 6);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (by_load(s)) {
      CableNumbers changed = s.cable;
      changed.strand_yield = shape[0];
      changed.strand_stiffness = 0.3 / s.cable.compliance;
      return strand_columns(s, changed) / changed.strand_stiffness;
    }
    const Eigen::VectorXd& q = driver(s);
    Eigen::MatrixXd out(s.rows(), 3);
    for (int i = 0; i < 3; ++i) {
      out.col(i) = -direction_memory(q, shape[0] * std::pow(3.0, i - 1), s.fresh);
    }
    return out;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    if (by_load(s)) {
      return {{"stiffness", b[0], per(effort_unit(s), position_unit(s))},
              {"yield", shape[0], position_unit(s)}};
    }
    const std::string suffix = from().empty() ? "" : "_from_" + from();
    return {{"half_loop" + suffix, b.sum(), amplitude_unit(s)},
            {"width" + suffix, shape[0], position_unit(s)},
            {"half_loop_narrow" + suffix, b[0], amplitude_unit(s)},
            {"half_loop_wide" + suffix, b[2], amplitude_unit(s)}};
  }
  std::string inconsistency(const Series& s, const Shape&,
                            const Eigen::VectorXd& b) const override {
    if (!from().empty()) return {};
    if (by_load(s)) {
      if (b[0] <= 0.0) return "strands would give effort";
      // Between none and all of them, with room for noise.
      if (b.size() > 1 && (b[1] < -0.3 * b[0] || b[1] > 1.3 * b[0]))
        return "more strands would be open than there are";
      return b[0] * s.cable.compliance < kMostStrands ? ""
                                                      : "strands would be stiffer than the cable";
    }
    if (s.stage != Stage::kTracking && b.sum() <= 0.0)
      return "the joint would run ahead of its motor";
    return b.minCoeff() > -0.5 * b.cwiseAbs().maxCoeff()
               ? ""
               : "elements of opposite sign are no hysteresis";
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (s.stage == Stage::kTracking) return {"backlash", "presliding"};
    return {};
  }
  std::string separate_by() const override {
    return "nested reversals from 0.3 to 12 degrees, and holds of 30 s after a reversal: creep "
           "relaxes there, hysteresis stays";
  }

 private:
  [[nodiscard]] bool by_load(const Series& s) const {
    return from().empty() && replayed(s) && s.cable.compliance > 0.0 &&
           s.cable.strand_stiffness <= 0.0;
  }
  /// Change by strands whose loops close, and what it is more where they do not: laws of friction
  /// differ in that, and no plant says which is a cable's.
  static Eigen::MatrixXd strand_columns(const Series& s, CableNumbers changed) {
    Eigen::MatrixXd out(s.rows(), 2);
    out.col(0) = cable_change(s, changed);
    changed.strand_openness = 1.0;
    out.col(1) = cable_change(s, changed) - out.col(0);
    return out;
  }
  [[nodiscard]] const Eigen::VectorXd& driver(const Series& s) const {
    for (const Companion& other : s.others) {
      if (other.name == from()) return other.value;
    }
    return s.loop_motion();
  }
};

class HysteresisKind final : public EffectKind {
 public:
  HysteresisKind()
      : EffectKind("hysteresis", Stage::kTransmission,
                   {.abscissa = Abscissa::kLoad,
                    .probes = Probe::kLoaded | Probe::kReversals,
                    .cable = CablePart::kStrands,
                    .follows_joint = true,
                    .moves_joint = true}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    const Series& s = context.series;
    if (s.stage != Stage::kTransmission && s.stage != Stage::kTracking) return;
    forms.push_back(std::make_unique<HysteresisForm>(*this, ""));
    if (s.stage != Stage::kTransmission) return;
    for (const Companion& other : s.others)
      forms.push_back(std::make_unique<HysteresisForm>(*this, other.name));
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (builder.in(Stage::kTransmission))
      builder.of_cable(*this, "stiffness", per(effort_unit(s), position_unit(s)),
                       s.cable.strand_stiffness,
                       [](CableNumbers& n, double f) { n.strand_stiffness *= f; });
  }
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint& joint) const override {
    const bool cable = joint.find_effect("compliance") != nullptr;
    if (!cable && e.parameters.front().name.starts_with("half_loop")) return loop_values(e);
    if (plant_value(e, "stiffness") <= 0.0) return {};
    return same_values(e, {"stiffness", "yield"});
  }
};

}  // namespace

const EffectKind& hysteresis_kind() {
  static const HysteresisKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
