// SPDX-License-Identifier: Apache-2.0
//
// The transmission ratio is not the one in the plant: the error grows with the joint's own
// position, the same in both directions and under all loads.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class GainError final : public EffectForm {
 public:
  explicit GainError(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return range_of(s, s.motion.q) > 20.0 * s.rest_width() ? "" : "the joint hardly moves";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return s.motion.q;  // about the joint's zero, so that a constant is left to homing_offset
  }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"ratio", b[0], "1"}};
  }
  std::string inconsistency(const Series&, const Shape&, const Eigen::VectorXd& b) const override {
    return std::abs(b[0]) < 0.5 ? "" : "a ratio cannot be wrong by half";
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (weighs_by_stretch(s) && s.weight.size() == 0) return {"gravity"};
    return {};
  }
  std::string separate_by() const override {
    return "repeat the same motion with 0.5 kg on the tool: a wrong ratio stays, stretch grows";
  }
};

class GainErrorKind final : public EffectKind {
 public:
  GainErrorKind()
      : EffectKind("gain_error", Stage::kTransmission, {.probes = Probe::kWholeRange}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<GainError>(*this));
  }
  void predict(NominalBuilder& builder) const override {
    if (!builder.in(Stage::kTransmission)) return;
    builder.linear(*this, "ratio", "1", builder.parameter(*this, "ratio"), motor_part(builder));
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"ratio"});
  }

 private:
  /// The motor's share of the joint's position: what a wrong ratio multiplies.
  static Eigen::VectorXd motor_part(const NominalBuilder& builder) {
    const physics::Plant& plant = builder.plant();
    const Series& s = builder.series();
    const std::size_t index = plant.joint_index(s.joint).value_or(0);
    Eigen::VectorXd part = s.motion.q;
    for (const Companion& other : s.others) {
      const auto k = plant.joint_index(other.name);
      if (k && index < plant.coupling.size()) part -= plant.coupling[index][*k] * other.value;
    }
    return part;
  }
};

}  // namespace

const EffectKind& gain_error_kind() {
  static const GainErrorKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
