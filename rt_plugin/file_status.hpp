// SPDX-License-Identifier: Apache-2.0
//
// fstat as a system call: the C library's has a symbol version that older systems lack. On 64-bit
// systems the kernel's structure is the C library's. Not for the real-time thread.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace ravencal::rt {

static_assert(sizeof(long) == 8);

inline bool file_status(int file, struct stat& status) noexcept {
  return ::syscall(SYS_fstat, file, &status) == 0;
}

/// Of `path` itself, not of what it links to.
inline bool path_status(const char* path, struct stat& status) noexcept {
  return ::syscall(SYS_newfstatat, AT_FDCWD, path, &status, AT_SYMLINK_NOFOLLOW) == 0;
}

}  // namespace ravencal::rt
