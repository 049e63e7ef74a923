// SPDX-License-Identifier: Apache-2.0
//
// What of the recordings could be compared with the plant, and why the rest could not.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "diagnose/findings/findings.hpp"
#include "diagnose/model/likelihood.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Every channel that has used rows, and every stage of a joint that has none. Motion and load are
/// those of the rows that were fitted. `held_out`: of the same channels; null: none.
void add_looked_at(const Likelihood& fitted, const Likelihood* held_out,
                   const physics::Plant& given, Report& report);

/// Why that stage ("command", "drive"; anything else is behind the motor) of a joint was not looked
/// at.
std::string why_not(const Likelihood& fitted, std::size_t joint, std::string_view stage);

}  // namespace ravencal::diagnose
