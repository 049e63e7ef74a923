// SPDX-License-Identifier: Apache-2.0
//
// What a process knows of its output files: which files they may not replace, because it reads
// them, and which are unfinished and go when a signal ends the process.
#pragma once

#include <atomic>
#include <filesystem>
#include <span>

#include "core/result.hpp"

namespace ravencal::core {

/// Names files that the process reads: from here on nothing that it writes replaces them. Devices,
/// pipes and what does not exist count for nothing. Call it before other threads start.
void protect_inputs(std::span<const std::filesystem::path> paths);

/// kUsage where `path` leads to an input, by whatever name.
Status check_output(const std::filesystem::path& path);

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

/// Removes them all, the latest first. For signal handlers that end the process.
void remove_unfinished() noexcept;

}  // namespace ravencal::core
