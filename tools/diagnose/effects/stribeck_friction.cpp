// SPDX-License-Identifier: Apache-2.0
//
// Friction is higher at low speed than in full motion: extra * exp(-(v / v_s)^2) against the motion
// (Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 1994).
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class StribeckFriction final : public EffectForm {
 public:
  explicit StribeckFriction(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 4 ? "" : "the motion reverses fewer than four times";
  }
  std::vector<Shape> grid(const Series& s) const override {
    const double v = s.training_rms(s.motion.v);
    return log_grid(0.02 * v, v, 7);
  }
  bool continuous() const override { return true; }
  /// What a little of it adds to bristles that bend at the same time: per unit, to first order.
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    constexpr double kLittle = 0.1;
    DryFriction f{s.friction_displacement(), kLittle, shape[0], FallOff::kSteep};
    const Eigen::VectorXd with = dry_friction(s, f);
    f.extra = 0.0;
    return (with - dry_friction(s, f)) / kLittle;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"extra", b[0], amplitude_unit(s)}, {"velocity", shape[0], per(position_unit(s), "s")}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would fall towards rest";
  }
  std::string prerequisite() const override { return "coulomb_friction"; }
  std::string separate_by() const override {
    return "passes at 0.1, 0.3 and 1 times the usual speed, and starts from rest";
  }
};

class StribeckFrictionKind final : public EffectKind {
 public:
  StribeckFrictionKind()
      : EffectKind("stribeck_friction", Stage::kDrive,
                   {.origin = Origin::kDriveFriction,
                    .abscissa = Abscissa::kSpeed,
                    .probes = Probe::kSpeeds,
                    .friction = Friction::kFall}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<StribeckFriction>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }
  /// Either law of the fall over speed is the same friction: no simulation has it exactly.
  void predict(NominalBuilder& builder) const override {
    const double extra = builder.parameter(*this, "extra");
    if (!builder.friction() || extra <= 0.0) return;
    const Series& s = builder.series();
    NominalBuilder::PlantFriction& friction = *builder.friction();
    friction.law.extra = extra / friction.level;
    friction.law.velocity = std::max(1e-9, builder.parameter(*this, "velocity"));
    friction.effort = builder.effort_of(friction.level, friction.law);
    builder.linear(*this, "extra", s.unit, extra, (friction.effort - friction.dry) / extra);
    DryFriction steep = friction.law;
    steep.fall_off = FallOff::kSteep;
    builder.form(*this, "velocity", position_unit(s), steep.velocity, 1.0,
                 builder.effort_of(friction.level, steep) - friction.effort);
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"extra", "velocity"});
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kStribeckExtra, "extra", true, true},
  }};
};

}  // namespace

const EffectKind& stribeck_friction_kind() {
  static const StribeckFrictionKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
