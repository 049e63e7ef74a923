// SPDX-License-Identifier: Apache-2.0
#include "commands/ros_program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

namespace ravencal::commands {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> own_arguments() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> arguments;
  for (std::string argument; std::getline(file, argument, '\0');) arguments.push_back(argument);
  return arguments;
}

}  // namespace

fs::path own_path() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error);
}

std::optional<fs::path> find_ros_program() {
  const fs::path folder = own_path().parent_path();
  for (const fs::path& candidate :
       {folder / "ravencal-ros", folder / "../libexec/ravencal/ravencal-ros",
        folder / "../lib/ravencal/ravencal-ros"}) {
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return std::nullopt;
}

core::Status become_ros_program(const std::string& command) {
  const auto program = find_ros_program();
  if (!program) {
    return core::Error{core::ErrorCode::kUsage,
                       "this needs ROS 1: install the package ravencal-ros, or libroscpp-dev and "
                       "build ravencal again"};
  }
  const std::vector<std::string> arguments = own_arguments();
  const auto first = std::find(arguments.begin(), arguments.end(), command);
  std::vector<std::string> handed = {program->string()};
  handed.insert(handed.end(), first, arguments.end());
  std::vector<char*> pointers;
  for (std::string& argument : handed) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  ::execv(program->c_str(), pointers.data());
  return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be started: {}",
                                                       program->string(), std::strerror(errno))};
}

}  // namespace ravencal::commands
