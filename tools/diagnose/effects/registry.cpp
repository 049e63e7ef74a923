// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "diagnose/effects/effects.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::diagnose {

const EffectKind& gain_error_kind();
const EffectKind& coupling_kind();
const EffectKind& compliance_kind();
const EffectKind& backlash_kind();
const EffectKind& joint_friction_kind();
const EffectKind& hysteresis_kind();
const EffectKind& creep_kind();
const EffectKind& eccentricity_kind();
const EffectKind& coulomb_friction_kind();
const EffectKind& viscous_friction_kind();
const EffectKind& stribeck_friction_kind();
const EffectKind& presliding_kind();
const EffectKind& asymmetric_friction_kind();
const EffectKind& load_dependent_friction_kind();
const EffectKind& torque_constant_kind();
const EffectKind& torque_ripple_kind();
const EffectKind& effort_offset_kind();
const EffectKind& saturation_kind();
const EffectKind& inertia_error_kind();
const EffectKind& gravity_kind();
const EffectKind& flexible_mode_kind();
const EffectKind& delay_kind();
const EffectKind& quantisation_kind();
const EffectKind& thermal_drift_kind();

std::span<const EffectKind* const> effect_kinds() {
  static const std::array kKinds = {
      &homing_offset_kind(),
      &gain_error_kind(),
      &coupling_kind(),
      &compliance_kind(),
      &backlash_kind(),
      &joint_friction_kind(),
      &hysteresis_kind(),
      &creep_kind(),
      &eccentricity_kind(),
      &slip_kind(),
      &coulomb_friction_kind(),
      &viscous_friction_kind(),
      &stribeck_friction_kind(),
      &presliding_kind(),
      &asymmetric_friction_kind(),
      &load_dependent_friction_kind(),
      &torque_constant_kind(),
      &torque_ripple_kind(),
      &effort_offset_kind(),
      &saturation_kind(),
      &controller_gain_kind(),
      &inertia_error_kind(),
      &gravity_kind(),
      &payload_kind(),
      &flexible_mode_kind(),
      &delay_kind(),
      &lost_counts_kind(),
      &quantisation_kind(),
      &thermal_drift_kind(),
      &input_disturbance_kind(),
      &unknown_kind(),
  };
  return kKinds;
}

const EffectKind& effect_kind(std::string_view id) {
  const auto kinds = effect_kinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [id](const EffectKind* kind) { return kind->id() == id; });
  return found == kinds.end() ? unknown_kind() : **found;
}

std::string_view EffectKind::sentence() const {
  const physics::EffectSpec* spec = physics::find_effect_spec(id_);
  return spec != nullptr ? spec->sentence : traits_.sentence;
}

Forms forms_for(const Series& series, const Nominal& nominal, const Eigen::VectorXd& further_load) {
  Forms forms;
  for (const EffectKind* kind : effect_kinds())
    kind->add_forms({series, nominal, further_load}, forms);
  return forms;
}

}  // namespace ravencal::diagnose
