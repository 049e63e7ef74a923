// SPDX-License-Identifier: Apache-2.0
//
// What recordings of the RAVEN twin and of any other plant have in common.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "simulation/session.hpp"

namespace ravencal::simulation {

double rate_of_rows(const physics::Plant& plant, const SessionOptions& options);
/// Errors (kUsage): a rate that does not divide the controller's.
core::Result<std::int64_t> cycles_per_row(const physics::Plant& plant,
                                          const SessionOptions& options);
std::map<std::string, std::string> meta_of(const physics::Plant& plant,
                                           const SessionOptions& options);

}  // namespace ravencal::simulation
