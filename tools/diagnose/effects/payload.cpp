// SPDX-License-Identifier: Apache-2.0
//
// A weight on the last link that the plant does not have: it loads every joint as the plant's
// geometry says, per kilogram; where no drive was recorded, it is seen by what it stretches.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Payload final : public EffectForm {
 public:
  explicit Payload(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (s.payload_effort.size() > 0) return "the joints of the arm have weighed it together";
    if (s.payload_per_kg.size() == 0) return "the plant does not say where a payload would hang";
    return range_of(s, s.payload_per_kg) > 0.0 ? "" : "a payload's effort would not change";
  }
  /// Friction behind the cable grows with its load and holds a joint that a weight pulls down: what
  /// the drive feels of more weight, as of the plant's own (nominal gravity), goes through both.
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    constexpr double kTrial_kg = 0.5;
    if (weighs_by_stretch(s)) {
      const Eigen::VectorXd more = kTrial_kg * s.payload_per_kg;
      const Eigen::VectorXd loaded = s.weight.size() > 0 ? s.weight + more : more;
      return (cable_stretch(s, s.cable) - cable_stretch(s, loaded, s.cable)) / kTrial_kg;
    }
    const bool rubs = s.cable.friction_level > 0.0 || s.cable.friction_load_share > 0.0;
    if (!rubs || s.weight.size() == 0) return s.payload_per_kg;
    const Eigen::VectorXd loaded = s.weight + kTrial_kg * s.payload_per_kg;
    return (cable_tension(s, loaded, s.cable) - cable_tension(s, s.weight, s.cable)) / kTrial_kg;
  }
  bool ordinary(const Series&) const override { return true; }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"mass", b[0], "kg"}};
  }
  std::string inconsistency(const Series& s, const Shape&,
                            const Eigen::VectorXd& b) const override {
    return b[0] > -s.removable_mass_kg ? "" : "less than nothing would hang on the last link";
  }
  std::string separate_by() const override {
    return "the same motion with the tool taken off, or with a known weight added";
  }
};

class PayloadKind final : public EffectKind {
 public:
  PayloadKind()
      : EffectKind("payload", Stage::kDrive,
                   {.origin = Origin::kArmLoad,
                    .probes = Probe::kLoaded | Probe::kWeighed,
                    .sentence = "a weight hangs on the tool that the plant does not have",
                    .enters_at = "drive",
                    .weight = Weight::kOnTool}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive || weighs_by_stretch(context.series))
      forms.push_back(payload());
  }
  bool improve(physics::Plant& improved, const PlantFinding& finding) const override {
    const double mass_kg = finding.plant.payload.mass_kg + plant_value(finding.effect, "mass");
    if (mass_kg < 0.0) return false;
    improved.payload.mass_kg = mass_kg;
    return true;
  }
};

}  // namespace

const EffectKind& payload_kind() {
  static const PayloadKind kind;
  return kind;
}

std::unique_ptr<EffectForm> payload() { return std::make_unique<Payload>(payload_kind()); }

}  // namespace ravencal::diagnose
