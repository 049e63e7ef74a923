// SPDX-License-Identifier: Apache-2.0
//
// Effects that happen at single moments, and the controller's gain: channels find them by rules of
// their own and by no form.
#include "diagnose/effects/effects.hpp"

namespace ravencal::diagnose {

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
  static const EffectKind kind(
      "controller_gain", Stage::kCommand,
      {.probes = Probe::kPulses, .sentence = "the controller's gain is not the plant's"});
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
