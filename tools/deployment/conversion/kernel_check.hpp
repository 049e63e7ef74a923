// SPDX-License-Identifier: Apache-2.0
//
// Runs weights on the kernels of the real-time plugin before they are written.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::conversion {

/// The blob's self-test as the plugin's load runs it, with every instruction set of this processor.
/// Returns their names. Errors (kData): not a blob, or one of them is farther off than the blob
/// allows.
core::Result<std::vector<std::string>> check_kernels(std::span<const std::byte> blob,
                                                     const std::string& name);

}  // namespace ravencal::conversion
