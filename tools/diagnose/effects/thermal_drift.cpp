// SPDX-License-Identifier: Apache-2.0
//
// Warm-up: the error approaches its final value with one time constant, whatever the arm does.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class ThermalDriftForm final : public EffectForm {
 public:
  explicit ThermalDriftForm(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (duration(s) < 120.0) return "the recording is shorter than two minutes";
    return {};
  }
  std::vector<Shape> grid(const Series& s) const override {
    return log_grid(duration(s) / 8.0, duration(s), 5);
  }
  bool continuous() const override { return true; }
  bool time_only() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    return (1.0 - (-s.t_s.array() / shape[0]).exp()).matrix();
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"final", b[0], amplitude_unit(s)}, {"time", shape[0], "s"}};
  }
  std::string separate_by() const override {
    return "record again after an hour of motion: drift has ended then, creep and slip have not";
  }

 private:
  static double duration(const Series& s) { return range_of(s, s.t_s); }
};

class ThermalDriftKind final : public EffectKind {
 public:
  ThermalDriftKind()
      : EffectKind("thermal_drift", Stage::kTransmission,
                   {.abscissa = Abscissa::kTime, .probes = Probe::kWarm}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<ThermalDriftForm>(*this));
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (builder.in(Stage::kTransmission))
      builder.slow_changes(*this, "wander", s.unit, Eigen::VectorXd::Ones(s.rows()));
  }
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"final", "time"});
  }
};

}  // namespace

const EffectKind& thermal_drift_kind() {
  static const ThermalDriftKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
