// SPDX-License-Identifier: Apache-2.0
//
// The cable yields slowly under load and recovers slowly (standard linear solid): the stretch that
// is still to come is the load minus its lagged self. How far it had come when the recording began
// depends on what the arm did before.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class CreepForm final : public EffectForm {
 public:
  explicit CreepForm(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (s.transmitted.size() == 0 && s.loads.size() != 1) {
      return "no single load on this joint is known";
    }
    return duration(s) > 30.0 ? "" : "the recording is shorter than 30 s";
  }
  std::vector<Shape> grid(const Series& s) const override { return log_grid(3.0, longest(s), 6); }
  bool continuous() const override { return true; }
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    if (replayed(s)) {
      CableNumbers changed = s.cable;
      const double load = std::max(1e-12, s.training_rms(s.transmitted));
      changed.creep_compliance = 3.0 * s.rest_width() / load;
      changed.creep_time_s = shape[0];
      Eigen::MatrixXd out(s.rows(), 2);
      out.col(0) = cable_change(s, changed) / changed.creep_compliance;
      out.col(1) = left_from_start(s, shape[0]);
      return out;
    }
    const Eigen::VectorXd& load = s.transmitted.size() > 0 ? s.transmitted : s.loads.front().value;
    return -low_pass(load, s.t_s, shape[0], s.fresh);
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    return {{"compliance", b[0], per(amplitude_unit(s), effort_unit(s))}, {"time", shape[0], "s"}};
  }
  std::string inconsistency(const Series& s, const Shape& shape,
                            const Eigen::VectorXd& b) const override {
    if (b[0] <= 0.0) return "the cable would shorten under load";
    if (shape[0] > 0.98 * longest(s)) return "the recording is too short to see its end";
    // Between none of it and half as much again, with room for noise.
    const bool begins_somewhere = b.size() < 2 || (b[1] > -0.5 * b[0] && b[1] < 1.5 * b[0]);
    return begins_somewhere ? "" : "more creep would be left at the start than there is";
  }
  std::string separate_by() const override {
    return "hold a loaded pose for three minutes, then the opposite pose: creep relaxes with the "
           "load's sign, drift does not";
  }

 private:
  /// Load at each start, fading as creep does: the joint is ahead by what has not crept yet.
  static Eigen::VectorXd left_from_start(const Series& s, double time_s) {
    Eigen::VectorXd out(s.rows());
    double load = 0.0;
    double since_s = 0.0;
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      if (i == 0 || s.fresh[static_cast<std::size_t>(i)] != 0) {
        load = s.transmitted[i];
        since_s = s.t_s[i];
      }
      out[i] = load * std::exp(-(s.t_s[i] - since_s) / time_s);
    }
    return out;
  }
  /// Creep slower than that cannot be told from a drift.
  static double longest(const Series& s) { return std::max(6.0, duration(s) / 4.0); }
  static double duration(const Series& s) { return range_of(s, s.t_s); }
};

class CreepKind final : public EffectKind {
 public:
  CreepKind()
      : EffectKind(
            "creep", Stage::kTransmission,
            {.abscissa = Abscissa::kTime, .probes = Probe::kHolds, .cable = CablePart::kCreep}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kTransmission)
      forms.push_back(std::make_unique<CreepForm>(*this));
  }
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (builder.in(Stage::kTransmission))
      builder.of_cable(*this, "compliance", per(position_unit(s), effort_unit(s)),
                       s.cable.creep_compliance,
                       [](CableNumbers& n, double f) { n.creep_compliance *= f; });
  }
  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint&) const override {
    return same_values(e, {"compliance", "time"});
  }
};

}  // namespace

const EffectKind& creep_kind() {
  static const CreepKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
