// SPDX-License-Identifier: Apache-2.0
//
// Effects that happen at single moments, and the controller's gain: channels find them by rules of
// their own and by no form.
#include <algorithm>
#include <limits>

#include "diagnose/effects/effects.hpp"

namespace ravencal::diagnose {
namespace {

class ControllerGainKind final : public EffectKind {
 public:
  ControllerGainKind()
      : EffectKind(
            "controller_gain", Stage::kCommand,
            {.probes = Probe::kPulses, .sentence = "the controller's gain is not the plant's"}) {}
  /// The law's gain, where all recordings agree on it.
  bool improve(physics::Plant& improved, const PlantFinding& finding) const override {
    const physics::Joint& joint = finding.plant.joints[finding.joint];
    double least = std::numeric_limits<double>::infinity(), most = 0.0;
    for (const NamedEffect& e : finding.named) {
      if (e.id != id() || e.joint != joint.name) continue;
      least = std::min(least, e.parameters.front().value);
      most = std::max(most, e.parameters.front().value);
    }
    if (!joint.controller || !(least > 0.0) || most > 1.1 * least) return false;
    improved.joints[finding.joint].controller->kp_n_m_per_rad =
        joint.controller->kp_n_m_per_rad * 0.5 * (least + most);
    return true;
  }
};

}  // namespace

const EffectKind& slip_kind() {
  static const EffectKind kind("slip", Stage::kTransmission,
                               {.abscissa = Abscissa::kTime,
                                .probes = Probe::kHomings,
                                .sentence = "the cable slips on its pulley",
                                .step = true});
  return kind;
}

const EffectKind& lost_counts_kind() {
  static const EffectKind kind("lost_counts", Stage::kTransmission,
                               {.abscissa = Abscissa::kTime,
                                .probes = Probe::kHomings,
                                .sentence = "the encoder loses counts",
                                .enters_at = "sensor",
                                .step = true});
  return kind;
}

const EffectKind& controller_gain_kind() {
  static const ControllerGainKind kind;
  return kind;
}

const EffectKind& input_disturbance_kind() {
  static const EffectKind kind(
      "input_disturbance", Stage::kCommand,
      {.abscissa = Abscissa::kTime,
       .probes = Probe::kPulses,
       .sentence = "pulses reach the drive that the controller did not send"});
  return kind;
}

}  // namespace ravencal::diagnose
