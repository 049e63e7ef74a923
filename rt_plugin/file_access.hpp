// SPDX-License-Identifier: Apache-2.0
//
// Who else can have written a weight file. Called while loading, never by the real-time thread.
#pragma once

#include <span>

namespace ravencal::rt {

/// True if `file`, opened at `path`, belongs to root or to this process's user, nobody else may
/// write it, and nobody else may put another file in its place: the same holds for every folder
/// above it, where a folder with the sticky bit may be open to all. Modes and POSIX access control
/// lists decide. A group counts as nobody else if it is this process's (root's for what is root's).
/// Else a sentence that names path, mode, list or owner, and the remedy is in `why`.
bool only_owners_write(int file, const char* path, std::span<char> why) noexcept;

}  // namespace ravencal::rt
