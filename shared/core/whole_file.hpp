// SPDX-License-Identifier: Apache-2.0
//
// Files that are read or written whole. What is written appears under its name only when all of it
// is on the disk; until then it is `NAME.partial`, and whatever fails, NAME is as it was and no
// partial file stays. Any thread, one per path.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::core {

/// Errors: kIo, with the system's reason.
Result<std::string> read_whole_file(const std::filesystem::path& path);

/// Errors: kIo, with the system's reason.
Status write_whole_file(const std::filesystem::path& path, std::string_view bytes);

/// The same for what is written bit by bit: write to partial(), then publish().
class PartialFile {
 public:
  explicit PartialFile(std::filesystem::path path);
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  /// Removes the partial file, unless it has been published.
  ~PartialFile();

  [[nodiscard]] const std::filesystem::path& partial() const { return partial_; }
  /// Gives the file its name. Errors: kIo.
  Status publish();

 private:
  std::filesystem::path path_;
  std::filesystem::path partial_;
};

/// `PATH: cannot be written: reason; remedy`, with the reason that errno gives. kIo.
Error write_error(const std::filesystem::path& path, int reason);

}  // namespace ravencal::core
