// SPDX-License-Identifier: Apache-2.0
//
// Hides one effect in a plant of the twin, so that its owner can see what `diagnose` makes of it.
// The joint and the effect are drawn, and the size is chosen by what two sessions of the plant
// differ by in any case. The kinds that are drawn were chosen among those that `diagnose` can name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "conceal/observed.hpp"
#include "core/result.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::conceal {

/// Sizes that are drawn, as multiples of the scatter: even in their logarithm.
inline constexpr double kLeastSize = 10.0;
inline constexpr double kMostSize = 20.0;

struct Hidden {
  std::size_t joint = 0;
  physics::Effect effect;
  std::string parameter;  ///< of the effect: the one whose size was drawn
  Visibility visibility;  ///< in the motion for which it was chosen
};

/// Draws an effect that the plant lacks, and its size in this motion. The same seed hides the same.
/// `scratch` is a file for sessions that are looked at; it does not stay.
/// Errors: no RAVEN plant, or nothing that the motion could show (kData); stopped by `look`
/// (kUsage).
core::Result<Hidden> conceal(const physics::Plant& plant, const trajectory::Trajectory& motion,
                             std::uint64_t seed, const std::filesystem::path& scratch,
                             const std::function<bool()>& look);

/// The plant's file with the effect in it.
core::Result<std::string> hidden_plant(const std::filesystem::path& plant_file,
                                       const physics::Plant& plant, const Hidden& hidden);

/// What is hidden, for `reveal` (JSON; shared/FORMATS.md).
std::string answer_json(const physics::Plant& plant, const Hidden& hidden, std::uint64_t seed);

}  // namespace ravencal::conceal
