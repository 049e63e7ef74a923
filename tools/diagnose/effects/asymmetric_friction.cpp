// SPDX-License-Identifier: Apache-2.0
//
// Friction differs between the two directions. Its constant part can only be told from a constant
// load if the joint also rests; its viscous part always can.
#include <array>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class AsymmetricFriction final : public EffectForm {
 public:
  explicit AsymmetricFriction(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return reversals(s) >= 4 ? "" : "the motion reverses fewer than four times";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return s.motion.v.cwiseAbs();
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"damping_difference", 2.0 * b[0], s.prismatic ? "N_s_per_m" : "N_m_s_per_rad"}};
  }
  std::string compares(bool /*uneven*/) const override { return "direction"; }
  std::string separate_by() const override {
    return "the same motion with the arm turned over: a load changes its sign, friction does not";
  }
};

/// The constant part, which a channel finds as its own constant. Rows at rest are not fitted, so
/// that a constant effort of the drive makes the same column.
class LevelDifference final : public EffectForm {
 public:
  explicit LevelDifference(const EffectKind& kind) : EffectForm(kind) {}
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return Eigen::VectorXd::Ones(s.rows());
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"level_difference", 2.0 * b[0], effort_unit(s)}};
  }
  std::vector<std::string> look_alikes(const Series&) const override { return {"effort_offset"}; }
  std::string separate_by() const override {
    return "the same motion with the arm turned over: a load changes its sign, friction does not; "
           "and the drive at rest with the motor off: an offset of the effort stays, friction does "
           "not";
  }
};

class AsymmetricFrictionKind final : public EffectKind {
 public:
  AsymmetricFrictionKind()
      : EffectKind("asymmetric_friction", Stage::kDrive,
                   {.origin = Origin::kDriveFriction,
                    .abscissa = Abscissa::kSpeed,
                    .friction = Friction::kUneven}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<AsymmetricFriction>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"damping_difference", "level_difference"});
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kAsymmetry, "damping_difference", false, true},
  }};
};

}  // namespace

const EffectKind& asymmetric_friction_kind() {
  static const AsymmetricFrictionKind kind;
  return kind;
}

std::unique_ptr<EffectForm> level_difference() {
  return std::make_unique<LevelDifference>(asymmetric_friction_kind());
}

}  // namespace ravencal::diagnose
