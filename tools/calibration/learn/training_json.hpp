// SPDX-License-Identifier: Apache-2.0
//
// What a model knows of its training, as JSON: the errors that are expected of it, the motion that
// it was trained on, and the seeds of simulated recordings.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/expected_error.hpp"
#include "model/motion_range.hpp"
#include "model/random_seeds.hpp"

namespace ravencal::learn {

std::string expected_text(const std::vector<model::ExpectedError>& expected);
/// Errors (kData): not one of each output.
core::Result<std::vector<model::ExpectedError>> expected_from(const nlohmann::json& list,
                                                              std::size_t outputs);

std::string motion_text(const model::MotionRange& motion);
/// Errors (kData): not one of each output.
core::Result<model::MotionRange> motion_from(const nlohmann::json& joints, std::size_t outputs);

nlohmann::json seeds_json(const std::vector<model::RandomSeeds>& seeds);
/// Errors (kData): an item is not a recording with its seeds.
core::Result<std::vector<model::RandomSeeds>> seeds_from(const nlohmann::json& list);

}  // namespace ravencal::learn
