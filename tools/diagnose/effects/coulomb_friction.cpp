// SPDX-License-Identifier: Apache-2.0
//
// Dry friction of the drive: a constant effort against the motion, held at rest.
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class CoulombFriction final : public EffectForm {
 public:
  explicit CoulombFriction(const EffectKind& kind) : EffectForm(kind) {}
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

class CoulombFrictionKind final : public EffectKind {
 public:
  CoulombFrictionKind()
      : EffectKind("coulomb_friction", Stage::kDrive,
                   {.origin = Origin::kDriveFriction,
                    .abscissa = Abscissa::kSpeed,
                    .probes = Probe::kReversals,
                    .friction = Friction::kDry}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    const Stage stage = context.series.stage;
    if (stage == Stage::kDrive || stage == Stage::kTracking)
      forms.push_back(std::make_unique<CoulombFriction>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    const double level = builder.parameter(*this, "level");
    if (!builder.in(Stage::kDrive) || level <= 0.0) return;
    const DryFriction law{s.friction_displacement()};
    const Eigen::VectorXd dry = builder.effort_of(level, law);
    builder.linear(*this, "level", s.unit, level, dry / level)->variation =
        builder.parameter(*this, "variation");
    builder.slow_changes(*this, "variation", "1", dry);
    builder.friction() = NominalBuilder::PlantFriction{level, law, dry, dry};
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    if (find_parameter(e, "level") != nullptr) return same_values(e, {"level"});
    return {{"lag", plant_value(e, "lag")}, {"width", 2.0 * plant_value(e, "displacement")}};
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kLevel, "level", true, true},
  }};
};

}  // namespace

const EffectKind& coulomb_friction_kind() {
  static const CoulombFrictionKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
