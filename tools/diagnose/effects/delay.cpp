// SPDX-License-Identifier: Apache-2.0
//
// Two streams are stamped at different times, or the servo lags: the error grows with speed and
// changes its sign with it.
#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

class Delay final : public EffectForm {
 public:
  explicit Delay(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    if (s.training_rms(s.motion.v) <= 0.0) return "the joint does not move";
    const double period_s =
        s.rows() > 1 ? (s.t_s[s.rows() - 1] - s.t_s[0]) / static_cast<double>(s.rows() - 1) : 1.0;
    return std::abs(period_s) < 0.1 ? "" : "samples are further apart than any delay";
  }
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override { return -s.motion.v; }
  std::vector<FormParameter> parameters(const Series&, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    return {{"delay", b[0], "s"}};
  }
  std::string inconsistency(const Series& s, const Shape&,
                            const Eigen::VectorXd& b) const override {
    if (s.stage == Stage::kTracking && b[0] < 0.0)
      return "the joint would know its command in advance";
    return std::abs(b[0]) < 0.2 ? "" : "no stream or servo is late by a fifth of a second";
  }
  std::vector<std::string> look_alikes(const Series& s) const override {
    if (s.stage == Stage::kTracking) return {"viscous_friction"};
    return {};
  }
  std::string separate_by() const override {
    return "repeat the motion at half and at double speed: a delay's error follows the speed, "
           "hysteresis keeps its loop";
  }
};

class DelayKind final : public EffectKind {
 public:
  DelayKind()
      : EffectKind("delay", Stage::kTransmission,
                   {.origin = Origin::kClock,
                    .abscissa = Abscissa::kSpeed,
                    .probes = Probe::kSpeeds,
                    .enters_at = "sensor"}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    const Stage stage = context.series.stage;
    if (stage == Stage::kTransmission || stage == Stage::kTracking)
      forms.push_back(std::make_unique<Delay>(*this));
  }
  /// A reading of the truth is stamped late by its transfer. A recorder that pairs the nearest
  /// stamps adds nothing on average, one that repeats the latest reading half a period: which it
  /// does is not known, nor the alignment of its streams.
  void predict(NominalBuilder& builder) const override {
    if (!builder.in(Stage::kTransmission)) return;
    const Series& s = builder.series();
    const physics::Logger& logger = builder.plant().logger;
    const double latency_s = logger.truth_latency_s;
    if (latency_s <= 0.0) {
      builder.form(*this, "alignment", "s", 0.0, 1.0, -kAlignment_s * s.motion.v);
      return;
    }
    const double pairing_s = 0.25 * logger.truth_period_s;
    NominalTerm* latency =
        builder.linear(*this, "truth_latency", "s", latency_s + pairing_s, -s.motion.v);
    latency->tolerance = (0.1 * latency_s + pairing_s + kAlignment_s) / (latency_s + pairing_s);
    latency->beyond_is_effect = true;
  }

  [[nodiscard]] PlantValues plant_values(const NamedEffect& e,
                                         const physics::Joint& joint) const override {
    const bool cable = joint.find_effect("compliance") != nullptr;
    if (cable || plant_value(e, "delay") <= 0.0) return {};
    return same_values(e, {"delay"});
  }

  /// Where the plant describes its recorder, a late stream is the recorder's.
  bool improve(physics::Plant& improved, const PlantFinding& finding) const override {
    const NamedEffect& e = finding.effect;
    const physics::Logger& logger = finding.plant.logger;
    const double whole_s =
        logger.truth_latency_s + plant_value(e, "delay") +
        (e.out_of_tolerance ? plant_value(e, "truth_latency") - logger.truth_latency_s -
                                  0.5 * logger.truth_period_s
                            : 0.0);
    if (e.stage != "sensor" || !logger.given || whole_s < 0.0)
      return EffectKind::improve(improved, finding);
    improved.logger.truth_latency_s = whole_s;
    return true;
  }
  /// How a recorder pairs its streams within its tolerance is no number of the plant.
  [[nodiscard]] bool refits(const physics::Joint&) const override { return false; }

 private:
  /// Two streams of one recorder are rarely aligned better.
  static constexpr double kAlignment_s = 0.003;
};

}  // namespace

const EffectKind& delay_kind() {
  static const DelayKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
