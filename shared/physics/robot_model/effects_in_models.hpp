// SPDX-License-Identifier: Apache-2.0
//
// Which effects of a plant a robot model can state, and where. shared/FORMATS.md shows this table.
#pragma once

#include <span>
#include <string_view>

#include "physics/plant.hpp"

namespace ravencal::physics {

struct EffectInModels {
  std::string_view id;
  std::string_view read_from;    ///< of MJCF; empty: no model is read so
  std::string_view mjcf;         ///< what `plant to` writes; empty: MJCF cannot say it
  std::string_view urdf;         ///< the same of URDF
  bool in_callback = false;      ///< the callback's source adds it to MJCF
  std::string_view remark = {};  ///< why not, or when
};

/// One row for each id of effect_specs(), in its order.
std::span<const EffectInModels> effects_in_models();
const EffectInModels& in_models(std::string_view effect);

/// True unless all of the effect's sizes are zero.
bool acts(const Effect& effect);

}  // namespace ravencal::physics
