// SPDX-License-Identifier: Apache-2.0
//
// Which numbers of a plant `[joint.tolerance]` may speak of.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Every key that a tolerance may have: an effect's id, a parameter, "id.parameter" or
/// "id_parameter". What a joint has without naming an effect counts as one: `inertia_error`,
/// `gravity`, `centre_of_mass`, `controller_gain`; where its carrier holds it: `link_length`,
/// `link_axial`, `link_across`, `joint_zero`.
std::vector<std::string> tolerance_keys();

/// Where a plant states none.
inline constexpr double kUnstatedTolerance = 0.10;
/// The same of a link's centre of mass, m: drawings are without cables, screws and paint.
inline constexpr double kUnstatedCentre_m = 0.006;

/// How far the plant says that parameter of the joint may be off, relative.
std::optional<double> stated_tolerance(const Joint& joint, const std::string& id,
                                       const std::string& parameter);
/// The same, or kUnstatedTolerance.
double tolerance_of(const Joint& joint, const std::string& id, const std::string& parameter);

/// What is wrong with that key, and which ones name numbers of this joint; empty if it is a key.
std::string flaw_of_tolerance(std::string_view key, const Joint& joint);

}  // namespace ravencal::physics
