// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::core {

/// Project version (semantic versioning). The plugin ABI, the blob and the recording carry their
/// own versions, because they change on their own.
inline constexpr const char* kVersion = "0.1.0";

}  // namespace ravencal::core
