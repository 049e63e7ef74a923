// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/file_access.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstring>

namespace ravencal::rt {
namespace {

constexpr std::size_t kMaxPath = 4096;
using Path = std::array<char, kMaxPath>;

// The system call, not fstat: that has a symbol version that older systems lack. On 64-bit systems
// the kernel's structure is the C library's.
static_assert(sizeof(long) == 8);
bool status_of(int file, struct stat& status) noexcept {
  return ::syscall(SYS_fstat, file, &status) == 0;
}

unsigned mode_of(const struct stat& status) noexcept {
  return static_cast<unsigned>(status.st_mode) & 07777U;
}

bool is_ours(const struct stat& status) noexcept {
  return status.st_uid == 0 || status.st_uid == ::geteuid();
}

bool others_write(const struct stat& status) noexcept {
  const bool everyone = (status.st_mode & S_IWOTH) != 0;
  const gid_t own_group = status.st_uid == 0 ? 0 : ::getegid();
  const bool group = (status.st_mode & S_IWGRP) != 0 && status.st_gid != own_group;
  return everyone || group;
}

/// Cuts the last component off; false if none is left above it.
bool to_folder(Path& path) noexcept {
  char* const slash = std::strrchr(path.data(), '/');
  if (slash == nullptr) {
    if (std::strcmp(path.data(), ".") == 0) return false;
    std::strcpy(path.data(), ".");
    return true;
  }
  if (slash == path.data()) {
    if (slash[1] == '\0') return false;
    slash[1] = '\0';
    return true;
  }
  *slash = '\0';
  return true;
}

/// Checks every folder above `path`.
bool folders_are_safe(Path path, const char* blob, std::span<char> why) noexcept {
  while (to_folder(path)) {
    const int folder = ::open(path.data(), O_PATH | O_DIRECTORY | O_CLOEXEC);
    struct stat status = {};
    const bool known = folder >= 0 && status_of(folder, status);
    if (folder >= 0) ::close(folder);
    if (!known) {
      (void)std::snprintf(why.data(), why.size(), "%s: its folder %s cannot be examined", blob,
                          path.data());
      return false;
    }
    if (!is_ours(status)) {
      (void)std::snprintf(
          why.data(), why.size(),
          "%s: user %u owns its folder %s and could replace it; keep it in a folder "
          "of root's or of user %u's",
          blob, static_cast<unsigned>(status.st_uid), path.data(),
          static_cast<unsigned>(::geteuid()));
      return false;
    }
    if ((status.st_mode & S_ISVTX) == 0 && others_write(status)) {
      (void)std::snprintf(why.data(), why.size(),
                          "%s: mode %04o of its folder lets others replace it: chmod go-w %s", blob,
                          mode_of(status), path.data());
      return false;
    }
  }
  return true;
}

Path copy_of(const char* path) noexcept {
  Path copy{};
  (void)std::snprintf(copy.data(), copy.size(), "%s", path);
  return copy;
}

}  // namespace

bool only_owners_write(int file, const char* path, std::span<char> why) noexcept {
  struct stat status = {};
  if (!status_of(file, status)) {
    (void)std::snprintf(why.data(), why.size(), "%s: its mode cannot be read", path);
    return false;
  }
  if (!is_ours(status)) {
    (void)std::snprintf(why.data(), why.size(),
                        "%s: belongs to user %u; only files of root and of user %u are loaded: "
                        "chown it",
                        path, static_cast<unsigned>(status.st_uid),
                        static_cast<unsigned>(::geteuid()));
    return false;
  }
  if (others_write(status)) {
    (void)std::snprintf(why.data(), why.size(),
                        "%s: its mode %04o lets others write it: chmod go-w %s", path,
                        mode_of(status), path);
    return false;
  }
  if (!folders_are_safe(copy_of(path), path, why)) return false;
  // Where a link led: without /proc only the way there is checked.
  std::array<char, 32> descriptor{};
  (void)std::snprintf(descriptor.data(), descriptor.size(), "/proc/self/fd/%d", file);
  Path real{};
  const ssize_t length = ::readlink(descriptor.data(), real.data(), real.size() - 1);
  return length <= 0 || real[0] != '/' || folders_are_safe(real, path, why);
}

}  // namespace ravencal::rt
