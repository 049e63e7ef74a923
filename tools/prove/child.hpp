// SPDX-License-Identifier: Apache-2.0
//
// Runs the tool under proof as a process of its own in an empty folder: it sees the files that it
// is given and no path to anything else of the proof.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"

namespace ravencal::prove {

struct ChildResult {
  int exit_code = -1;  ///< -1: ended by a signal or by the time limit
  bool timed_out = false;
  double wall_s = 0.0, cpu_s = 0.0;
  std::string log;  ///< what it printed, both streams, the last 4000 characters
  std::vector<std::pair<std::string, std::string>> files;  ///< wanted outputs: name, content
};

struct ChildOptions {
  std::vector<std::string> command;  ///< program (absolute path) and arguments
  /// Copied into the folder before: source, name there.
  std::vector<std::pair<std::filesystem::path, std::string>> given;
  std::vector<std::string> wanted;  ///< read from the folder afterwards, if there
  double limit_s = 600.0;
  std::function<bool()> look;  ///< asked ten times a second; false ends the child
};

/// Errors: kIo if the folder or the process cannot be made, kUsage if `look` said stop.
core::Result<ChildResult> run_child(const ChildOptions& options);

}  // namespace ravencal::prove
