// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"

namespace ravencal::learn {

/// SHA-256 of a file's bytes, 64 hexadecimal digits. Errors: kIo.
core::Result<std::string> sha256_of_file(const std::filesystem::path& path);

}  // namespace ravencal::learn
