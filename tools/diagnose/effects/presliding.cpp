// SPDX-License-Identifier: Apache-2.0
//
// Friction yields elastically before it slips (Dahl): after a reversal the friction effort turns
// over a displacement instead of at once. The column is what that changes against sharp Coulomb
// friction.
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Presliding final : public EffectForm {
 public:
  explicit Presliding(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 6 ? "" : "the motion reverses fewer than six times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    // Without a cable in the plant, its wind-up under friction turns over a displacement too.
    const double reach = s.cable.compliance > 0.0 ? 0.05 : 0.2;
    return log_grid(3.0 * s.rest_width(),
                    std::max(6.0 * s.rest_width(), reach * range_of(s, s.motion.q)), 6);
  }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return bristle_side(s.motion.q, 0.5 * shape[0], s.fresh) -
           bristle_side(s.motion.q, s.friction_displacement(), s.fresh);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"level", b[0], amplitude_unit(s)}, {"displacement", 0.5 * shape[0], position_unit(s)}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would overshoot after a reversal";
  }
  std::string prerequisite() const override { return "coulomb_friction"; }
  std::string separate_by() const override {
    return "reversals of 0.05, 0.2 and 1 degree around one pose";
  }
};

class PreslidingKind final : public EffectKind {
 public:
  PreslidingKind()
      : EffectKind("presliding", Stage::kDrive,
                   {.origin = Origin::kDriveFriction,
                    .probes = Probe::kReversals,
                    .friction = Friction::kOnset}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive) forms.push_back(std::make_unique<Presliding>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }
  /// How friction turns over a reversal is a matter of its microphysics, which no simulation has
  /// exactly: bristles from half to six times as long are all the same friction.
  void predict(NominalBuilder& builder) const override {
    if (!builder.friction()) return;
    const NominalBuilder::PlantFriction& friction = *builder.friction();
    for (const double factor : {0.5, 2.5, 6.0}) {
      DryFriction longer = friction.law;
      longer.displacement *= factor;
      builder.form(*this, "displacement", position_unit(builder.series()), longer.displacement, 1.0,
                   builder.effort_of(friction.level, longer) - friction.effort);
    }
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"displacement"});
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kPresliding, "displacement", true, false},
  }};
};

}  // namespace

const EffectKind& presliding_kind() {
  static const PreslidingKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
