// SPDX-License-Identifier: Apache-2.0
//
// Friction grows with the effort that passes through gears or over pulleys (Euler and Eytelwein;
// Duclusaud et al., ICRA 2025, model M3). The effort is the one that the plant's mass and weight
// ask for and the friction behind the cable adds to, never the recorded one.
#include <array>
#include <utility>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

/// The motor's own inertia is on the other side of the gears.
const Eigen::VectorXd& passed_on(const Series& s) {
  return s.transmitted.size() > 0 ? s.transmitted : s.weight;
}

class LoadDependentFriction final : public EffectForm {
 public:
  LoadDependentFriction(const EffectKind& kind, Eigen::VectorXd further)
      : EffectForm(kind), further_(std::move(further)) {}
  std::string untestable(const Series& s) const override {
    if (s.weight.size() == 0) return "the plant's links have no weight, so the load is not known";
    const double change = range_of(s, s.weight.cwiseAbs());
    return change > 0.2 * s.weight.cwiseAbs().maxCoeff() ? "" : "the load hardly changes";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    const Eigen::VectorXd side = bristle_side(s.motion.q, s.friction_displacement(), s.fresh);
    if (further_.size() == 0) return side.cwiseProduct(passed_on(s).cwiseAbs());
    return side.cwiseProduct((passed_on(s) + further_).cwiseAbs());
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"load_share", b[0], "1"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return b[0] > 0.0 && b[0] < 1.0 ? "" : "friction cannot fall with load nor exceed it";
  }
  /// Friction that differs between the directions does so in what load adds to it as well.
  std::string compares(bool uneven) const override { return uneven ? "direction" : ""; }
  std::string separate_by() const override {
    return "the same motion with 0, 250 and 500 g on the tool";
  }

 private:
  Eigen::VectorXd further_;
};

class LoadDependentFrictionKind final : public EffectKind {
 public:
  LoadDependentFrictionKind()
      : EffectKind("load_dependent_friction", Stage::kDrive,
                   {.origin = Origin::kDriveFriction,
                    .abscissa = Abscissa::kLoad,
                    .probes = Probe::kLoaded,
                    .friction = Friction::kByLoad}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<LoadDependentFriction>(*this, context.further_load));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"load_share"});
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {{
      {physics::DriveField::kLoadShare, "load_share", true, true},
  }};
};

}  // namespace

const EffectKind& load_dependent_friction_kind() {
  static const LoadDependentFrictionKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
