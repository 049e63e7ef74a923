// SPDX-License-Identifier: Apache-2.0
//
// Files that are read or written whole. What is written appears under its name only when all of it
// is on the disk; until then it lies beside it in the folder `NAME.xxxxxxxx.partial`, which nobody
// else may enter, and whatever fails, NAME is as it was. No partial file stays, unless the process
// is killed (SIGKILL). A link stays a link, a replaced file keeps its mode; a device, a pipe or a
// descriptor (/dev/stdout) is written to and never replaced. core/outputs.hpp says what may be
// replaced. Any thread.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/outputs.hpp"
#include "core/result.hpp"

namespace ravencal::core {

/// Errors: kIo, with the system's reason.
Result<std::string> read_whole_file(const std::filesystem::path& path);

/// Errors: kIo, with the system's reason; those of core::check_output.
Status write_whole_file(const std::filesystem::path& path, std::string_view bytes);

/// The same for what is written bit by bit: write to partial() or descriptor(), then publish().
class PartialFile {
 public:
  /// An empty file that no other process has. Errors: kIo; those of core::check_output.
  static Result<PartialFile> create(const std::filesystem::path& path);
  PartialFile(PartialFile&& other) noexcept;
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  PartialFile& operator=(PartialFile&&) = delete;
  /// Removes the partial file, unless publish() was called.
  ~PartialFile();

  /// For libraries that open files by name; the file must stay the same.
  [[nodiscard]] const std::filesystem::path& partial() const;
  /// The same file, open for writing at its beginning.
  [[nodiscard]] int descriptor() const;
  /// What the file becomes: `path`, or what it links to.
  [[nodiscard]] const std::filesystem::path& target() const;
  /// Waits for the disk, then gives the file its name, or writes it to the device. While an
  /// OutputGroup lives, that is done by it. Errors: kIo; those of core::check_output, which asks
  /// again; kUsage where another writer has taken the name of a new file.
  Status publish();
  /// The same unless a file has the name, whatever may be replaced.
  Status publish_new();

 private:
  friend class OutputGroup;
  struct Impl;
  explicit PartialFile(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;  ///< with an OutputGroup
};

/// Several outputs that appear together or not at all. While it lives, the process's publish()
/// calls only wait for the disk. One at a time; of one thread.
class OutputGroup {
 public:
  OutputGroup();
  OutputGroup(const OutputGroup&) = delete;
  OutputGroup& operator=(const OutputGroup&) = delete;
  OutputGroup(OutputGroup&&) = delete;
  OutputGroup& operator=(OutputGroup&&) = delete;
  /// Removes what has not been published.
  ~OutputGroup();

  /// Gives all of them their names. Errors: those of PartialFile::publish; then each name is as it
  /// was, but what a device took stays there.
  Status publish();

 private:
  friend class PartialFile;
  using Files = std::vector<std::shared_ptr<PartialFile::Impl>>;
  static Status publish(const Files& files);
  Files waiting_;
};

/// `PATH: cannot be written: reason; remedy`, with the reason that errno gives. kIo.
Error write_error(const std::filesystem::path& path, int reason);

}  // namespace ravencal::core
