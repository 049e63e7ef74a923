// SPDX-License-Identifier: Apache-2.0
//
// The motor gives more or less effort than commanded: the recorded effort is the needed one over
// 1 + ratio. The needed effort is the plant's, friction included, so that recorded noise does not
// explain itself.
#include <algorithm>
#include <array>
#include <cmath>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

/// The drive's gain is a number of the plant like any other.
constexpr double kTolerance = 0.10;

class TorqueConstant final : public EffectForm {
 public:
  TorqueConstant(const EffectKind& kind, const Eigen::VectorXd& needed)
      : EffectForm(kind), needed_(needed) {}
  Eigen::MatrixXd columns(const Series&, const Shape&) const override { return -needed_; }
  bool as_seen_already() const override { return true; }
  bool ordinary(const Series&) const override { return true; }
  std::optional<double> off_by(const Eigen::VectorXd& b) const override {
    return ratio_of(b[0]) / kTolerance;
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"ratio", ratio_of(b[0]), "1"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    const double ratio = ratio_of(b[0]);
    return b[0] < 0.5 && ratio > -0.5 ? "" : "no motor is that far from its data sheet";
  }
  std::string separate_by() const override {
    return "the same motion with a known weight on the tool: a wrong torque constant scales it, a "
           "wrong mass adds to it";
  }

 private:
  /// Recorded effort is the needed one over 1 + ratio, and 1 - b times it.
  static double ratio_of(double b) { return 1.0 / std::max(1.0 - b, 1e-6) - 1.0; }

  const Eigen::VectorXd& needed_;
};

class TorqueConstantKind final : public EffectKind {
 public:
  TorqueConstantKind()
      : EffectKind("torque_constant", Stage::kDrive,
                   {.abscissa = Abscissa::kSpeed, .probes = Probe::kSpeeds | Probe::kWeighed}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<TorqueConstant>(*this, context.nominal.prediction));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }
  /// Recorded effort is the needed one over 1 + ratio.
  void predict(NominalBuilder& builder) const override {
    if (builder.in(Stage::kDrive)) builder.scale_effort(1.0 + builder.parameter(*this, "ratio"));
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"ratio"});
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kTorqueRatio, "ratio", false, true},
  }};
};

}  // namespace

const EffectKind& torque_constant_kind() {
  static const TorqueConstantKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
