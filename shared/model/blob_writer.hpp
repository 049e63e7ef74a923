// SPDX-License-Identifier: Apache-2.0
//
// CalibrationModel to weight blob and back, for tools. The plugin reads blobs with blob_view.hpp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/packed_model.hpp"

namespace ravencal::model {

/// The bytes of the blob of `model`. Its self-test vectors are rows within the trained range with
/// the outputs that double precision gives for the weights as they were packed. Errors: sizes that
/// do not fit together, a value that is not finite or too large for the precision, a name that the
/// format cannot hold, int8 without layer inputs.
core::Result<std::vector<std::byte>> encode_blob(const CalibrationModel& model,
                                                 const Packing& packing = {});

/// Writes the bytes of a blob to `path`, whole or not at all.
core::Status write_blob(std::span<const std::byte> bytes, const std::filesystem::path& path);
/// Writes encode_blob(model, packing) to `path`.
core::Status write_blob(const CalibrationModel& model, const std::filesystem::path& path,
                        const Packing& packing = {});

/// The model in `bytes`. Errors name `source`, the reason and the byte offset.
core::Result<CalibrationModel> decode_blob(std::span<const std::byte> bytes,
                                           std::string_view source);
core::Result<CalibrationModel> read_blob(const std::filesystem::path& path);

/// What is in a blob, in words: precision, bytes per step, inputs, layers, outputs, ranges,
/// provenance.
core::Result<std::string> describe_blob(const std::filesystem::path& path);
/// The same as JSON.
core::Result<std::string> describe_blob_json(const std::filesystem::path& path);

}  // namespace ravencal::model
