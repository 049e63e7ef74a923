// SPDX-License-Identifier: Apache-2.0
//
// Origin of a model by its recordings: arm, robot, controller, coordinates.
#pragma once

#include <span>

#include "core/result.hpp"
#include "model/origin.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// From `meta`: robot, arm, controller, coordinates. A recording of `simulate` is in motor
/// coordinates, because no plugin corrects it; of another one the motors tell, where `meta` does
/// not (motor_coordinates.hpp). Arms other than gold and green, and what neither tells, are
/// unknown. Errors (kData): `meta` names unknown coordinates, or motor ones where the joints are
/// not the motors'.
core::Result<model::Origin> origin_of(const record::Recording& recording);

/// The origin that `given` (options) and all recordings have in common. Errors (kData) name the
/// recording and the value in which it disagrees with the others or with `given`, and a recording
/// whose joints hold a correction: what is left of the error is not the error.
core::Result<model::Origin> common_origin(const model::Origin& given,
                                          std::span<const record::Recording* const> recordings);

}  // namespace ravencal::learn
