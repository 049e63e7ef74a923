// SPDX-License-Identifier: Apache-2.0
//
// Whether a MAT-file of level 5 is whole. matio gives zeros, or what happens to be in memory, for
// what a file that was cut short lacks. Private to exchange/.
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace ravencal::exchange {

/// Every element ends within the file, and what is compressed has the checksum that it states.
/// Errors (kData) name the byte.
core::Status check_mat5(const std::filesystem::path& path);

}  // namespace ravencal::exchange
