// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "diagnose/vocabulary/scales.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"

namespace ravencal::diagnose {

/// The numbers of one joint that are always fitted: those of the plant within their tolerance, and
/// what every recording has of its own.
void add_numbers(const physics::Plant& plant, const Scales& scales, std::size_t recordings,
                 std::vector<Parameter>& numbers);

}  // namespace ravencal::diagnose
