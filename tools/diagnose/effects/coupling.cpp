// SPDX-License-Identifier: Apache-2.0
//
// Another joint's motion moves this one more or less than the plant says.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/routing.hpp"
#include "diagnose/effects/shapes.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

class Coupling final : public EffectForm {
 public:
  Coupling(const EffectKind& kind, const std::string& from) : EffectForm(kind, from) {}
  std::string untestable(const Series& s) const override {
    const Companion& other = companion(s);
    const double range = range_of(s, other.value);
    return range > 1e-4 ? "" : "joint " + from() + " hardly moves";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return companion(s).value;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"error_from_" + from(), b[0], per(amplitude_unit(s), companion(s).unit)}};
  }
  std::string separate_by() const override {
    return "move joint " + from() + " alone over its range while this joint holds still";
  }

 private:
  [[nodiscard]] const Companion& companion(const Series& s) const {
    for (const Companion& other : s.others) {
      if (other.name == from()) return other;
    }
    return s.others.front();
  }
};

class CouplingKind final : public EffectKind {
 public:
  CouplingKind()
      : EffectKind("coupling", Stage::kTransmission,
                   {.probes = Probe::kOneByOne, .moves_joint = true}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage != Stage::kTransmission) return;
    for (const Companion& other : context.series.others)
      forms.push_back(std::make_unique<Coupling>(*this, other.name));
  }
  void predict(NominalBuilder& builder) const override {
    if (!builder.in(Stage::kTransmission)) return;
    const Series& s = builder.series();
    for (const physics::Effect& effect : builder.joint().effects) {
      for (const Companion& other : s.others) {
        if (effect.id != id() || other.name != effect.from) continue;
        NominalTerm* term = builder.linear(*this, "error", per(s.unit, other.unit),
                                           effect.parameters.at("error"), other.value);
        if (term != nullptr) term->from = other.name;
      }
    }
    inherited(builder);
    carried(builder);
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return {{"error", plant_value(e, "error_from_" + e.from)}};
  }

 private:
  /// Half of what may be passed on is expected, none and all of it are as likely.
  void either(NominalBuilder& builder, std::string_view parameter, const std::string& from,
              const Eigen::VectorXd& column, double deviation = 1.0) const {
    if (column.isZero(0.0)) return;
    builder.add(0.5 * column);
    builder.form(*this, std::string(parameter), "1", 0.5, deviation, 0.5 * column)->from = from;
  }

  /// What moves this joint's cable beside its motor: stretch of the cables before it reaches those
  /// that follow links, as far as their stiffness is known, and no others.
  void inherited(NominalBuilder& builder) const {
    for (const Inherited& part : builder.series().inherited) {
      either(builder, "inherited_share", part.from, part.rest);
      if (!part.through) {
        either(builder, kStretchShare, part.from, part.stretch);
      } else if (*part.through == physics::Through::kLink && !part.stretch.isZero(0.0)) {
        builder.add(part.stretch);
        builder.form(*this, std::string(kStretchShare), "1", 1.0, kUnstatedTolerance, part.stretch)
            ->from = part.from;
      }
    }
  }

  /// What the cables of other joints may load this joint's with.
  void carried(NominalBuilder& builder) const {
    const Series& s = builder.series();
    if (!builder.has_cable()) return;
    for (const Carried& part : s.carried)
      either(builder, kLoadShare, part.from,
             builder.under_load(with(s.weight, part.weight), with(s.inertial, part.moving)),
             kLoadShareDeviation);
  }
};

}  // namespace

const EffectKind& coupling_kind() {
  static const CouplingKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
