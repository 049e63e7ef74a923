// SPDX-License-Identifier: Apache-2.0
//
// The part of a hidden effect that nothing else can imitate: parameters of the plant take any
// value, and one other effect of any size replaces it. The remainder identifies the effect. Where
// it is below the floor, either name is right.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "prove/generator/term_library.hpp"

namespace ravencal::prove {

struct Imitation {
  std::string by;     ///< id of the best imitator; "parameters": none is needed
  double left = 0.0;  ///< RMS of the effect that it leaves, in the channel's unit
};

/// `with` and `without` the effect share motion and noise; position is truth minus motor, else
/// effort. `own`: the effect's id, which does not imitate itself. Nothing where the channel is not
/// recorded.
std::optional<Imitation> best_imitation(const record::Recording& with,
                                        const record::Recording& without, const NominalRobot& plant,
                                        std::size_t joint, bool position, std::string_view own);

}  // namespace ravencal::prove
