// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "diagnose/findings/findings.hpp"
#include "diagnose/series/series.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// What each channel saw, and the stages that no channel shows with the reason.
void add_looked_at(const SeriesSet& set, const physics::Plant& plant, Report& report);

}  // namespace ravencal::diagnose
