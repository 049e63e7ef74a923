// SPDX-License-Identifier: Apache-2.0
//
// The way back of parse_plant: a plant as text.
#pragma once

#include <string>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// The plant as TOML, which parse_plant reads back to an equal plant, numbers to the last bit; only
/// `source` and `hash` belong to the text. Tables and keys in the order of the shipped plants.
/// What the reader would take for a missing table or key anyway is left out, but for [robot].
///
/// Wants a plant as parse_plant makes it: texts in UTF-8, a published controller branch or none, a
/// coupling of joints by joints. What it would refuse is written all the same, and refused when it
/// is read.
std::string plant_text(const Plant& plant);

}  // namespace ravencal::physics
