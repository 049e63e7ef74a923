// SPDX-License-Identifier: Apache-2.0
//
// The menu of recordings that change one circumstance, and which of them tells what about an
// effect.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "diagnose/findings/effect_words.hpp"

namespace ravencal::diagnose {

/// Motions that the digital twin can make, so that a recording's power can be predicted.
enum class Exercise {
  kNone,
  kLoaded,      ///< the same motion with 500 g
  kSpeeds,      ///< a third of the speed and three times
  kHolds,       ///< two poses, three minutes each
  kReversals,   ///< growing reversals around three poses
  kOneByOne,    ///< every joint alone
  kWholeRange,  ///< the whole range slowly both ways
};

/// A recording of the menu.
struct Experiment {
  Probe probe = Probe::kNone;
  std::string_view experiment{};
  double minutes = 0.0;
  Exercise motion = Exercise::kNone;
};

/// The cheapest one that one of the two effects answers to and the other does not; null where the
/// menu has none.
const Experiment* cheapest_parting(std::string_view id, std::string_view rival);

/// The cheapest one that the effect answers to; null where the menu has none.
const Experiment* cheapest_test(std::string_view id);

/// The one that changes what a shape without a name depends on; a repetition where that is unknown.
const Experiment& experiment_over(std::string_view circumstance);

/// What parts the effect from all its rivals, in words; the effect's own experiment where the menu
/// parts it from none of them.
std::string experiment_that_parts(std::string_view id, const std::vector<std::string>& rivals);

}  // namespace ravencal::diagnose
