// SPDX-License-Identifier: Apache-2.0
//
// A constant: motor zero and true zero differ since the last homing.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class HomingOffset final : public EffectForm {
 public:
  explicit HomingOffset(const EffectKind& kind) : EffectForm(kind) {}
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    return Eigen::VectorXd::Ones(s.rows());
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"offset", b[0], amplitude_unit(s)}};
  }
  std::string separate_by() const override {
    return "home twice more and record each time: a homing offset changes at the homing and at no "
           "other time";
  }
};

class HomingOffsetKind final : public EffectKind {
 public:
  HomingOffsetKind()
      : EffectKind("homing_offset", Stage::kTransmission,
                   {.abscissa = Abscissa::kTime, .probes = Probe::kHomings, .constant = true}) {}
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint& joint) const override {
    return {{"offset", plant_value(e, "offset")},
            {"deviation", joint.parameter(id(), "deviation")}};
  }
  /// Constants of joints that home are found at their stops.
  void settle(physics::Plant& improved, const PlantFinding& finding) const override {
    physics::Joint& joint = improved.joints[finding.joint];
    if (!joint.homing) return;
    const double constant = plant_value(finding.effect, "offset");
    set_values(joint, finding.effect,
               {{"offset", seat_at_stop(improved, finding.joint, constant)}});
  }
  /// A robot that homes finds its own offset each time.
  [[nodiscard]] bool refits(const physics::Joint& joint) const override {
    return !joint.homing && joint.find_effect(id()) == nullptr;
  }

 private:
  /// The seat that the joint must find at its stop for the constant that the recording shows: ratio
  /// and coupling are wrong about the stop, where counting begins, and the plant knows how far the
  /// controller's stop is from the encoder's. `improved` has every other number already.
  static double seat_at_stop(const physics::Plant& improved, std::size_t index, double constant) {
    const physics::Joint& joint = improved.joints[index];
    const auto stop = [&](std::size_t k) {
      const auto& homing = improved.joints[k].homing;
      return homing ? homing->stop_controller_ji : 0.0;
    };
    double motor_part = stop(index);
    for (std::size_t k = 0; k < improved.joints.size() && index < improved.coupling.size(); ++k)
      motor_part -= improved.coupling[index][k] * stop(k);
    double seat = constant + joint.parameter("gain_error", "ratio") * motor_part;
    for (const physics::Effect& effect : joint.effects) {
      const auto source = improved.joint_index(effect.from);
      const auto error = effect.parameters.find("error");
      if (source && error != effect.parameters.end()) seat += error->second * stop(*source);
    }
    return seat - (joint.homing->stop_encoder_ji - joint.homing->stop_controller_ji);
  }
};

}  // namespace

const EffectKind& homing_offset_kind() {
  static const HomingOffsetKind kind;
  return kind;
}

std::unique_ptr<EffectForm> homing_offset() {
  return std::make_unique<HomingOffset>(homing_offset_kind());
}

}  // namespace ravencal::diagnose
