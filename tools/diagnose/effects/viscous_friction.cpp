// SPDX-License-Identifier: Apache-2.0
//
// Friction that grows with speed.
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class ViscousFriction final : public EffectForm {
 public:
  explicit ViscousFriction(const EffectKind& kind) : EffectForm(kind) {}
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override { return s.motion.v; }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"damping", b[0], s.prismatic ? "N_s_per_m" : "N_m_s_per_rad"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 ? "" : "friction would drive the motion";
  }
  std::string separate_by() const override {
    return "the same motion at a third and at three times the speed";
  }
};

class ViscousFrictionKind final : public EffectKind {
 public:
  ViscousFrictionKind()
      : EffectKind("viscous_friction", Stage::kDrive,
                   {.origin = Origin::kDriveFriction,
                    .abscissa = Abscissa::kSpeed,
                    .probes = Probe::kSpeeds,
                    .friction = Friction::kBySpeed}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<ViscousFriction>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (builder.in(Stage::kDrive))
      builder.linear(*this, "damping", s.prismatic ? "N_s_per_m" : "N_m_s_per_rad",
                     builder.parameter(*this, "damping"), s.as_seen(s.motion.v));
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"damping"});
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kViscous, "damping", true, true},
  }};
};

}  // namespace

const EffectKind& viscous_friction_kind() {
  static const ViscousFrictionKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
