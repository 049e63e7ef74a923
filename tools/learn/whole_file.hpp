// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::learn {

/// Writes `bytes` to `path` through `path`.partial, renamed when whole. Errors (kIo): `path` is as
/// it was and nothing is left behind.
core::Status write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace ravencal::learn
