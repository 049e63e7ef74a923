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
