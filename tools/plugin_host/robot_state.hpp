// SPDX-License-Identifier: Apache-2.0
//
// From the catalogue (240 values, core/catalogue.hpp) to the C struct that a controller hands to
// the plugin: the inverse of the plugin's gather.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/catalogue.hpp"
#include "ravencal/plugin.h"

namespace ravencal::plugin_host {

/// The catalogue in SI units.
using CatalogueValues = std::array<double, core::kCatalogueSize>;

/// SI values from the units in which raven_state publishes them.
CatalogueValues to_si(std::span<const double, core::kCatalogueSize> message);

/// State of one cycle; every joint of the calibrated arm ready if `homed`. Values that are integers
/// on the robot are rounded; NaN there becomes 0. Real-time safe.
void fill_state(std::span<const double, core::kCatalogueSize> values_si, std::int64_t t_ns,
                bool homed, ravencal_state& state) noexcept;

}  // namespace ravencal::plugin_host
