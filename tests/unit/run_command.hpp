// SPDX-License-Identifier: Apache-2.0
//
// Runs a command line as a user would, for tests of programs.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace ravencal::test {

struct Outcome {
  int exit_code = -1;
  std::string text;
};

/// `command` by the shell; -1 where it did not exit by itself.
inline Outcome run_command(const std::string& command) {
  Outcome outcome;
  FILE* const pipe = ::popen(command.c_str(), "r");
  std::array<char, 4096> line{};
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) outcome.text += line.data();
  const int status = ::pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

}  // namespace ravencal::test
