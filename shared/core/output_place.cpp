// SPDX-License-Identifier: Apache-2.0
#include "core/output_place.hpp"

#include <unistd.h>

#include <charconv>
#include <optional>
#include <string>
#include <system_error>

namespace ravencal::core {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // as the kernel

/// The folder of `path`, without links; empty where there is none.
fs::path real_parent(const fs::path& path) {
  std::error_code absent;
  const fs::path parent = path.parent_path();
  fs::path real = fs::canonical(parent.empty() ? fs::path(".") : parent, absent);
  return absent ? fs::path() : real;
}

/// The number where `name` in `folder` is a descriptor of this process. Its link in /proc may name
/// a file that is deleted, or another one of that name by now.
std::optional<int> own_descriptor(const fs::path& folder, const std::string& name) {
  const std::string process = "/proc/" + std::to_string(::getpid()) + "/";
  const std::string place = folder.string();
  if (!place.starts_with(process) || folder.filename() != "fd") return std::nullopt;
  int number = -1;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return number;
}

OutputPlace::Kind kind_of(const struct stat& status) {
  if (S_ISREG(status.st_mode)) return OutputPlace::Kind::kFile;
  return S_ISDIR(status.st_mode) ? OutputPlace::Kind::kFolder : OutputPlace::Kind::kDevice;
}

}  // namespace

OutputPlace output_place(const fs::path& path) {
  OutputPlace place;
  place.path = path;
  for (int links = 0; links < kMostLinks; ++links) {
    const fs::path folder = real_parent(place.path);
    if (const auto number = own_descriptor(folder, place.path.filename().string())) {
      place.kind = OutputPlace::Kind::kDescriptor;
      place.descriptor = *number;
      (void)::fstat(*number, &place.status);
      return place;
    }
    if (::lstat(place.path.c_str(), &place.status) != 0) {
      place.kind = links == 0 ? OutputPlace::Kind::kNewFile : OutputPlace::Kind::kDanglingLink;
      return place;
    }
    place.kind = kind_of(place.status);
    if (!S_ISLNK(place.status.st_mode)) return place;
    std::error_code unreadable;
    const fs::path named = fs::read_symlink(place.path, unreadable);
    if (unreadable) break;
    place.path = named.is_absolute() ? named : folder / named;
  }
  place.kind = OutputPlace::Kind::kDanglingLink;
  return place;
}

}  // namespace ravencal::core
