// SPDX-License-Identifier: Apache-2.0
//
// The one owner of a process's outputs: which files it may not replace, and which are unfinished
// and go when a signal ends the process. All that is written whole (core/whole_file.hpp) asks here.
#pragma once

#include <atomic>
#include <filesystem>
#include <span>

#include "core/result.hpp"

namespace ravencal::core {

/// Names files that the process reads: from here on nothing that it writes replaces them. Of a
/// folder, the files in it. Devices, pipes and what does not exist count for nothing. Any thread.
void protect_inputs(std::span<const std::filesystem::path> paths);

/// From here on the process replaces no file but what it wrote itself and what may_renew() names,
/// as a command does without --force. Any thread.
void protect_existing();

/// A file, or all files below a folder but links, that protect_existing() does not protect. Any
/// thread.
void may_renew(const std::filesystem::path& path);

/// A folder that the process made for itself: what it writes there it may read at once, since no
/// OutputGroup keeps it back. Any thread.
void add_scratch(const std::filesystem::path& folder);
bool is_scratch(const std::filesystem::path& path);

/// Why nothing may be written to `path` now. kUsage: an input, by whatever name; a program, a
/// library or a key; a link to nothing; what protect_existing() protects. kIo: a folder; a database
/// that another process has open. Any thread.
Status check_output(const std::filesystem::path& path);

/// `PATH: exists already; ...`. kUsage.
Error exists_already(const std::filesystem::path& path);

/// Names a file, or a folder that is empty by then, that a signal removes (remove_unfinished)
/// while this object lives. More than a hundred at a time are not noted. Any thread.
class Unfinished {
 public:
  explicit Unfinished(const std::filesystem::path& path);
  Unfinished(Unfinished&& other) noexcept;
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  Unfinished& operator=(Unfinished&&) = delete;
  ~Unfinished();

 private:
  std::atomic<const char*>* slot_ = nullptr;
};

/// Removes them all, files before folders. For signal handlers that end the process.
void remove_unfinished() noexcept;

}  // namespace ravencal::core
