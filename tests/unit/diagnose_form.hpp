// SPDX-License-Identifier: Apache-2.0
//
// The form that an effect takes in a series of its own stage.
#pragma once

#include <memory>
#include <string_view>
#include <utility>

#include "diagnose/effects/effects.hpp"

namespace ravencal::generator {

/// `nominal` must outlive the form.
inline std::shared_ptr<const diagnose::EffectForm> form_of(std::string_view id,
                                                           diagnose::Series series,
                                                           const diagnose::Nominal& nominal,
                                                           const Eigen::VectorXd& further_load) {
  const diagnose::EffectKind& kind = diagnose::effect_kind(id);
  series.stage = kind.stage();
  diagnose::Forms forms;
  kind.add_forms({series, nominal, further_load}, forms);
  return forms.at(0);
}

inline std::shared_ptr<const diagnose::EffectForm> form_of(std::string_view id,
                                                           diagnose::Series series = {}) {
  static const diagnose::Nominal kNothing;
  return form_of(id, std::move(series), kNothing, {});
}

}  // namespace ravencal::generator
