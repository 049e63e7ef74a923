// SPDX-License-Identifier: Apache-2.0
//
// Cogging and ripple: the drive's effort waves over its position.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class TorqueRipple final : public EffectForm {
 public:
  explicit TorqueRipple(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return shows_waves(s) ? "" : "too few passes over a long enough range";
  }
  std::vector<Shape> grid(const Series& s) const override { return wave_orders(s, 2.0, 40.0, 42); }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return wave_columns(s, shape);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return wave_parameters(s, shape, b);
  }
  /// What turns in the drive turns at a whole multiple of its last shaft, as far as a range of
  /// positions tells orders apart.
  std::string inconsistency(const Series& s, const Shape& shape,
                            const Eigen::VectorXd&) const override {
    if (s.drive_order <= 0.0) return {};
    const double turns = std::max(1.0, std::round(shape[0] / s.drive_order));
    const double apart = std::numbers::pi / range_of(s, s.motion.q);
    return std::abs(shape[0] - turns * s.drive_order) < apart
               ? ""
               : "no part of the drive turns at this order";
  }
  std::string separate_by() const override {
    return "pass the range slowly both ways at 1 kHz: ripple repeats with the motor's poles";
  }
};

class TorqueRippleKind final : public EffectKind {
 public:
  TorqueRippleKind() : EffectKind("torque_ripple", Stage::kDrive, {.probes = Probe::kWholeRange}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<TorqueRipple>(*this));
  }
  [[nodiscard]] std::span<const DriveParameter> drive_parameters() const override {
    return kNumbers;
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"amplitude", "order", "phase"});
  }

 private:
  static constexpr std::array<DriveParameter, 2> kNumbers = {{
      {physics::DriveField::kRipple, "amplitude", true, true},
      {physics::DriveField::kRipplePhase, "phase", false, false},
  }};
};

}  // namespace

const EffectKind& torque_ripple_kind() {
  static const TorqueRippleKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
