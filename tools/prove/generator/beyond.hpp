// SPDX-License-Identifier: Apache-2.0
//
// How much of a hidden effect nothing else can imitate. Parameters of the plant may be anywhere and
// one known effect of any size may stand in for it; what then remains of the effect is what makes
// it an effect of its own. Below the floor, any of these names is as right as another.
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
