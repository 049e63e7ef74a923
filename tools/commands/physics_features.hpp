// SPDX-License-Identifier: Apache-2.0
//
// `train --physics` and what evaluates its models: the plant's predicted joint errors as channels
// `physics.JOINT` of a recording.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::commands {

inline constexpr const char* kPhysicsPrefix = "physics.";
/// Provenance entry of a model: the whole plant file, so that the model needs no file beside it.
inline constexpr const char* kPhysicsPlant = "physics_plant";

/// Adds the channels to each recording; `plant_text` is a plant's TOML, `source` stands for it in
/// messages.
core::Status add_physics(std::vector<record::Recording>& recordings, const std::string& plant_text,
                         const std::string& source);

/// The same where `model` was trained with --physics; nothing otherwise.
core::Status add_physics_of(const model::CalibrationModel& model,
                            std::vector<record::Recording>& recordings);

}  // namespace ravencal::commands
