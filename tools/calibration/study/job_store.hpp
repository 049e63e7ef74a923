// SPDX-License-Identifier: Apache-2.0
//
// Results of a study's jobs, so that an interrupted study continues: DIR/jobs/<key>.json, each
// written whole by whichever process ran the job. The key follows from the job's description,
// everything that the result depends on: a changed input is a new job, and an old result is never
// taken for a new one. Any thread.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "study/error_blocks.hpp"
#include "study/json_place.hpp"

namespace ravencal::study {

/// 16 hexadecimal digits of a job's description.
std::string key_of(std::string_view description);

/// The file of the job's result.
std::filesystem::path result_path(const std::filesystem::path& folder, std::string_view key);

/// Writes the result of the job with this description. Errors: kIo.
core::Status keep_result(const std::filesystem::path& folder, const std::string& description,
                         nlohmann::ordered_json result);

/// Calls `take` with the result of that job, if it is there; `take` may throw. True if it was.
/// Errors: kIo, kData for a damaged file or another job's.
core::Result<bool> take_result(const std::filesystem::path& folder, const std::string& description,
                               const std::function<void(const nlohmann::ordered_json&)>& take);

nlohmann::ordered_json json_of(const ErrorBlocks& blocks);
/// Throws for JSON of another form.
ErrorBlocks blocks_from(const JsonPlace& json);

}  // namespace ravencal::study
