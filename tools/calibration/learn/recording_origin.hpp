// SPDX-License-Identifier: Apache-2.0
//
// What recordings say of where a model comes from: arm, robot, controller, coordinates.
#pragma once

#include <span>

#include "core/result.hpp"
#include "model/origin.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// From `meta`: robot, arm, controller, coordinates. A recording of `simulate` is in motor
/// coordinates, for no plugin corrects there. Arms other than gold and green, and what `meta` does
/// not name, are unknown. Errors (kData): `meta` names coordinates that there are not.
core::Result<model::Origin> origin_of(const record::Recording& recording);

/// What `given` (by options) and all recordings say together. Errors (kData) name the recording and
/// the value in which it disagrees with the others or with `given`.
core::Result<model::Origin> common_origin(const model::Origin& given,
                                          std::span<const record::Recording* const> recordings);

}  // namespace ravencal::learn
