// SPDX-License-Identifier: Apache-2.0
//
// Motor and link are heavier or lighter to move than the plant's: a number that every plant has, so
// that it is found as one out of tolerance and by no form of its own.
#include <array>

#include "diagnose/effects/nominal_builder.hpp"

namespace ravencal::diagnose {
namespace {

class InertiaErrorKind final : public EffectKind {
 public:
  InertiaErrorKind()
      : EffectKind("inertia_error", Stage::kDrive,
                   {.origin = Origin::kArmLoad,
                    .probes = Probe::kSpeeds,
                    .sentence = "motor and link have another inertia than the plant's"}) {}
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (builder.in(Stage::kDrive))
      builder.linear(*this, "inertia", s.prismatic ? "kg" : "kg_m2", s.inertia, s.motion.a);
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }

  /// The link's own is known by its mass; the rest turns with the motor.
  bool improve(physics::Plant& improved, const PlantFinding& finding) const override {
    const physics::Joint& joint = finding.plant.joints[finding.joint];
    if (joint.motor_inertia_kg_m2 <= 0.0) return false;
    double link = joint.link.mass_kg;
    if (joint.kind == physics::JointKind::kRevolute) {
      link = joint.link.inertia_kg_m2[2] +
             joint.link.mass_kg * (joint.link.com_m[0] * joint.link.com_m[0] +
                                   joint.link.com_m[1] * joint.link.com_m[1]);
    }
    const double whole = finding.effect.parameters.front().in_plant();
    const double motor = (whole - link) / (joint.reduction * joint.reduction);
    if (motor <= 0.0) return false;
    improved.joints[finding.joint].motor_inertia_kg_m2 = motor;
    return true;
  }

 private:
  static constexpr std::array<DriveParameter, 1> kNumbers = {
      {{physics::DriveField::kInertia, "inertia"}}};
};

}  // namespace

const EffectKind& inertia_error_kind() {
  static const InertiaErrorKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
