// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/file_access.hpp"

#include <fcntl.h>
#include <linux/posix_acl.h>
#include <linux/posix_acl_xattr.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "rt_plugin/file_status.hpp"

namespace ravencal::rt {
namespace {

constexpr std::size_t kMaxPath = 4096;
using Path = std::array<char, kMaxPath>;

/// More than a robot's folder will ever have; longer lists are refused.
constexpr std::size_t kMostAclEntries = 256;
using AclBytes = std::array<char, sizeof(posix_acl_xattr_header) +
                                      kMostAclEntries * sizeof(posix_acl_xattr_entry)>;
constexpr char kAcl[] = "system.posix_acl_access";

unsigned mode_of(const struct stat& status) noexcept {
  return static_cast<unsigned>(status.st_mode) & 07777U;
}

bool is_ours(const struct stat& status) noexcept {
  return status.st_uid == 0 || status.st_uid == ::geteuid();
}

/// Somebody who may write besides root and this process's user and group.
struct Stranger {
  enum class Kind : std::uint8_t { kNobody, kByMode, kUser, kGroup, kUnknown };
  Kind kind = Kind::kNobody;
  unsigned id = 0;  ///< of the user or group that the access control list names
};

/// The group that counts as nobody else.
gid_t own_group_of(const struct stat& status) noexcept {
  return status.st_uid == 0 ? 0 : ::getegid();
}

Stranger stranger_in(std::span<const posix_acl_xattr_entry> list,
                     const struct stat& status) noexcept {
  unsigned mask = ACL_READ | ACL_WRITE | ACL_EXECUTE;
  for (const posix_acl_xattr_entry& entry : list) {
    if (entry.e_tag == ACL_MASK) mask = entry.e_perm;
  }
  for (const posix_acl_xattr_entry& entry : list) {
    if ((entry.e_perm & mask & ACL_WRITE) == 0) continue;
    const unsigned group = entry.e_tag == ACL_GROUP ? entry.e_id : status.st_gid;
    const bool of_group = entry.e_tag == ACL_GROUP || entry.e_tag == ACL_GROUP_OBJ;
    if (of_group && group != own_group_of(status)) return {Stranger::Kind::kGroup, group};
    const bool foreign = entry.e_id != 0 && entry.e_id != ::geteuid();
    if (entry.e_tag == ACL_USER && foreign) return {Stranger::Kind::kUser, entry.e_id};
  }
  return {};
}

/// The list as the kernel gives it: what acl_get_file of libacl would read, a library that the
/// plugin does without. `size`: what getxattr returned, and errno with it.
Stranger stranger_of(const struct stat& status, const AclBytes& bytes, ssize_t size) noexcept {
  if ((status.st_mode & S_IWOTH) != 0) return {Stranger::Kind::kByMode};
  if (size < 0 && (errno == ENODATA || errno == EOPNOTSUPP || errno == ENOSYS)) {
    const bool group = (status.st_mode & S_IWGRP) != 0 && status.st_gid != own_group_of(status);
    return {group ? Stranger::Kind::kByMode : Stranger::Kind::kNobody};
  }
  posix_acl_xattr_header header{};
  std::array<posix_acl_xattr_entry, kMostAclEntries> list{};
  const auto listed = static_cast<std::size_t>(size) - sizeof header;
  if (size < static_cast<ssize_t>(sizeof header) || listed % sizeof list[0] != 0) {
    return {Stranger::Kind::kUnknown};
  }
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.a_version != POSIX_ACL_XATTR_VERSION) return {Stranger::Kind::kUnknown};
  std::memcpy(list.data(), bytes.data() + sizeof header, listed);
  return stranger_in(std::span(list).first(listed / sizeof list[0]), status);
}

/// Whether there is a stranger; then `why` gets the sentence. `folder`: `path` is one above `blob`.
bool refuse(const Stranger& stranger, const char* blob, const char* path, bool folder,
            const struct stat& status, std::span<char> why) noexcept {
  const char* const what = folder ? " of its folder" : "";
  const char* const can = folder ? "replace" : "write";
  switch (stranger.kind) {
    case Stranger::Kind::kNobody:
      return false;
    case Stranger::Kind::kByMode:
      (void)std::snprintf(why.data(), why.size(),
                          "%s: mode %04o%s lets others %s it: chmod go-w %s", blob, mode_of(status),
                          what, can, path);
      return true;
    case Stranger::Kind::kUser:
    case Stranger::Kind::kGroup:
      (void)std::snprintf(why.data(), why.size(),
                          "%s: the access control list%s lets %s %u %s it: setfacl -b %s", blob,
                          what, stranger.kind == Stranger::Kind::kUser ? "user" : "group",
                          stranger.id, can, path);
      return true;
    case Stranger::Kind::kUnknown:
      break;
  }
  (void)std::snprintf(why.data(), why.size(),
                      "%s: the access control list%s cannot be read: setfacl -b %s", blob, what,
                      path);
  return true;
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
    const bool known = folder >= 0 && file_status(folder, status);
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
    AclBytes acl{};
    const ssize_t acl_size = ::getxattr(path.data(), kAcl, acl.data(), acl.size());
    const Stranger stranger = stranger_of(status, acl, acl_size);
    const bool sticky = (status.st_mode & S_ISVTX) != 0;  // a stranger can only add to it
    if (!sticky && refuse(stranger, blob, path.data(), true, status, why)) return false;
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
  if (!file_status(file, status)) {
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
  AclBytes acl{};
  const ssize_t acl_size = ::fgetxattr(file, kAcl, acl.data(), acl.size());
  if (refuse(stranger_of(status, acl, acl_size), path, path, false, status, why)) return false;
  if (!folders_are_safe(copy_of(path), path, why)) return false;
  // Where a link led: without /proc only the way there is checked.
  std::array<char, 32> descriptor{};
  (void)std::snprintf(descriptor.data(), descriptor.size(), "/proc/self/fd/%d", file);
  Path real{};
  const ssize_t length = ::readlink(descriptor.data(), real.data(), real.size() - 1);
  return length <= 0 || real[0] != '/' || folders_are_safe(real, path, why);
}

}  // namespace ravencal::rt
