// SPDX-License-Identifier: Apache-2.0
//
// A pulley runs out of true: a wave over the joint's position, the same in both directions.
#include <limits>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"
#include "diagnose/series/posture.hpp"

namespace ravencal::diagnose {
namespace {

class EccentricityForm final : public EffectForm {
 public:
  explicit EccentricityForm(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    return shows_waves(s) ? "" : "fewer than two periods of any pulley were passed, both ways";
  }
  // From a period and a fifth over the range up to 40: beyond, the passes' positions do not repeat
  // well enough.
  std::vector<Shape> grid(const Series& s) const override { return wave_orders(s, 1.2, 40.0, 44); }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return wave_columns(s, shape);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return wave_parameters(s, shape, b);
  }
  std::string separate_by() const override {
    return "pass the whole range slowly both ways ten times: a pulley's wave repeats at the order "
           "of a part in the drawing";
  }
};

class EccentricityKind final : public EffectKind {
 public:
  EccentricityKind()
      : EffectKind("eccentricity", Stage::kTransmission, {.probes = Probe::kWholeRange}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<EccentricityForm>(*this));
  }
  /// Run-out turns with the drive, wherever homing has put the zero from which the robot counts:
  /// the encoder says where, to a fraction of a turn.
  void predict(NominalBuilder& builder) const override {
    constexpr double kPhase_rad = 0.3;
    const double amplitude = builder.parameter(*this, "amplitude");
    if (!builder.in(Stage::kTransmission) || amplitude == 0.0) return;
    const Series& s = builder.series();
    const Eigen::VectorXd angle = builder.parameter(*this, "order") * encoder_position(s).array() +
                                  builder.parameter(*this, "phase");
    builder.linear(*this, "amplitude", s.unit, amplitude, angle.array().sin().matrix());
    builder.form(*this, "phase", "rad", 1.0, kPhase_rad, amplitude * angle.array().cos().matrix());
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"amplitude", "order", "phase"});
  }

 private:
  /// Own position as the encoder corrects it, in what is linear in the believed ones.
  static Eigen::VectorXd encoder_position(const Series& s) {
    std::vector<Eigen::VectorXd> believed = {s.motion.q}, truth = {s.motion.q + s.y};
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      if (s.valid[static_cast<std::size_t>(i)] == 0)
        truth.front()[i] = std::numeric_limits<double>::quiet_NaN();
    }
    for (const Companion& other : s.others) {
      believed.push_back(other.value);
      truth.emplace_back();
    }
    return posture_of(believed, truth, s.recording).front();
  }
};

}  // namespace

const EffectKind& eccentricity_kind() {
  static const EccentricityKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
