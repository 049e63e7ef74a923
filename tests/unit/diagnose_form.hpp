// SPDX-License-Identifier: Apache-2.0
//
// The form that an effect takes in a series of its own stage.
#pragma once

#include <memory>
#include <string_view>

#include "diagnose/effects/effects.hpp"

namespace ravencal::generator {

inline std::shared_ptr<const diagnose::EffectForm> form_of(
    std::string_view id, diagnose::Series series = {}, const Eigen::VectorXd& further_load = {}) {
  static const diagnose::Nominal kNothing;
  const diagnose::EffectKind& kind = diagnose::effect_kind(id);
  series.stage = kind.stage();
  diagnose::Forms forms;
  kind.add_forms({series, kNothing, further_load}, forms);
  return forms.at(0);
}

}  // namespace ravencal::generator
