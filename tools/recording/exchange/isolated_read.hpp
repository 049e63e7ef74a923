// SPDX-License-Identifier: Apache-2.0
//
// Reading by HDF5 and matio, which trust the bytes of a file, in a child process
// (core/isolated.hpp). Private to exchange/.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "exchange/named_array.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

using Arrays = std::vector<NamedArray>;
using MaybeRecording = std::optional<record::Recording>;

/// What `read` gives, or its error, or that the library failed on this file. `format` is what
/// errors call it: "HDF5".
core::Result<Arrays> in_child(const std::filesystem::path& path, const char* format,
                              core::Result<Arrays> (*read)(const std::filesystem::path&));
core::Result<MaybeRecording> in_child(
    const std::filesystem::path& path, const char* format,
    core::Result<MaybeRecording> (*read)(const std::filesystem::path&));

}  // namespace ravencal::exchange
