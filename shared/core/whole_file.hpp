// SPDX-License-Identifier: Apache-2.0
//
// Files that are read or written whole. What is written appears under its name only when all of it
// is on the disk; until then it lies beside it as `NAME.xxxxxxxx.partial`, and whatever fails, NAME
// is as it was. No partial file stays, unless the process is killed (SIGKILL). A link stays a link,
// a replaced file keeps its mode; a device or a pipe is written to and never replaced, nor is a
// file that the process reads (core/outputs.hpp). Any thread.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/outputs.hpp"
#include "core/result.hpp"

namespace ravencal::core {

/// Errors: kIo, with the system's reason.
Result<std::string> read_whole_file(const std::filesystem::path& path);

/// Errors: kIo, with the system's reason; kUsage for an input (core::check_output).
Status write_whole_file(const std::filesystem::path& path, std::string_view bytes);

/// The same for what is written bit by bit: write to partial(), then publish().
class PartialFile {
 public:
  /// An empty file that no other writer has, unless `path` is a device or a pipe: then that itself.
  /// Errors: kIo; kUsage for an input (core::check_output).
  static Result<PartialFile> create(const std::filesystem::path& path);
  PartialFile(PartialFile&& other) noexcept;
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  PartialFile& operator=(PartialFile&&) = delete;
  /// Removes the partial file, unless it has been published.
  ~PartialFile();

  [[nodiscard]] const std::filesystem::path& partial() const { return partial_; }
  /// What the file becomes: `path`, or what it links to.
  [[nodiscard]] const std::filesystem::path& target() const { return target_; }
  /// Waits for the disk, then gives the file its name. Errors: kIo.
  Status publish() { return publish(Replace::kYes); }
  /// The same unless a file has the name by now, of another writer perhaps. Errors: kUsage, kIo.
  Status publish_new() { return publish(Replace::kNo); }

 private:
  enum class Replace { kNo, kYes };
  explicit PartialFile(const std::filesystem::path& path);
  Status open_beside();
  Status publish(Replace replace);

  std::filesystem::path path_;  ///< as the user wrote it, for messages
  std::filesystem::path target_;
  std::filesystem::path partial_;
  std::optional<mode_t> mode_;       ///< of the file that is replaced
  std::optional<Unfinished> owned_;  ///< partial() is to be removed
};

/// `PATH: exists already; ...`. kUsage.
Error exists_already(const std::filesystem::path& path);

/// `PATH: cannot be written: reason; remedy`, with the reason that errno gives. kIo.
Error write_error(const std::filesystem::path& path, int reason);

}  // namespace ravencal::core
