// SPDX-License-Identifier: Apache-2.0
//
// What the path of an output leads to, through links, as it is now.
#pragma once

#include <sys/stat.h>

#include <filesystem>

namespace ravencal::core {

struct OutputPlace {
  enum class Kind {
    kNewFile,       ///< nothing is there yet, and no link either
    kFile,          ///< a regular file
    kFolder,        ///< whatever it holds
    kDevice,        ///< or a pipe, a socket
    kDescriptor,    ///< what this process has open: /dev/stdout, /dev/fd/N, /proc/self/fd/N
    kDanglingLink,  ///< a link to nothing, or to itself
  };
  Kind kind = Kind::kNewFile;
  std::filesystem::path path;  ///< behind all links; of a link to nothing, what it names
  int descriptor = -1;
  struct stat status = {};  ///< of a file, a device, and what a descriptor has open

  /// What is written to as it stands, and never renamed over.
  [[nodiscard]] bool is_stream() const {
    return kind == Kind::kDevice || kind == Kind::kDescriptor;
  }
};

OutputPlace output_place(const std::filesystem::path& path);

}  // namespace ravencal::core
