// SPDX-License-Identifier: Apache-2.0
//
// A plant from a compiled MuJoCo model: joints, frames, inertias, friction, drives and couplings.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "physics/robot_model/model_words.hpp"

namespace ravencal::physics {

/// What the model says and a plant cannot is listed in Plant::notes. Bodies that no joint moves
/// belong to the link that carries them. Each link's frame has the axes of its principal moments.
/// Errors (kData): a joint that is neither a hinge nor a slide, or no joint.
/// `words`: what the document says beside the model.
core::Result<Plant> plant_of_model(const mjModel& model, const std::string& source,
                                   const ModelWords& words = {});

}  // namespace ravencal::physics
