// SPDX-License-Identifier: Apache-2.0
//
// Frames and replicas of MJCF (MuJoCo 3) in the words of older versions.
#pragma once

#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {

/// Puts what stands in `frame` and `replicate` where these put it, with the names that MuJoCo gives
/// replicas, and what refers to them as often. Errors (kData, with the element's place): an
/// attribute that is no number, or more replicas than a robot has.
core::Status put_in_place(RobotDocument& document);

}  // namespace ravencal::physics
