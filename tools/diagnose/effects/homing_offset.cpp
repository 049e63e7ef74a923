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
