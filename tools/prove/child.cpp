// SPDX-License-Identifier: Apache-2.0
#include "prove/child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "core/temporary_folder.hpp"
#include "core/whole_file.hpp"

namespace ravencal::prove {
namespace {

namespace fs = std::filesystem;

core::Error io(const std::string& what, int reason) {
  return {core::ErrorCode::kIo, fmt::format("{}: {}", what, std::strerror(reason))};
}

core::Result<pid_t> spawn(const ChildOptions& options, const fs::path& folder,
                          const std::string& log) {
  std::vector<char*> arguments;
  for (const std::string& word : options.command)
    arguments.push_back(const_cast<char*>(word.c_str()));  // posix_spawn does not write there
  arguments.push_back(nullptr);
  // The child gets only the environment that locale and loader may need.
  std::string path = "PATH=/usr/bin:/bin", locale = "LC_ALL=C.UTF-8";
  char* environment[] = {path.data(), locale.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  // Its own group: Ctrl-C reaches the prover, which then ends the child.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t pid = 0;
  const int failed = posix_spawn(&pid, options.command.front().c_str(), &actions, &attributes,
                                 arguments.data(), environment);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return io(options.command.front() + " cannot be started", failed);
  return pid;
}

}  // namespace

core::Result<ChildResult> run_child(const ChildOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder folder, core::TemporaryFolder::create());
  // Holds the log, so that the child's own folder contains only its input.
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder outside, core::TemporaryFolder::create());
  for (const auto& [source, name] : options.given) {
    std::error_code error;
    fs::copy_file(source, folder.path() / name, error);
    if (error) return io(fmt::format("{} cannot be copied", source.string()), error.value());
  }
  const std::string log = (outside.path() / "log").string();
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto elapsed_s = [start] {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  RAVENCAL_ASSIGN_OR_RETURN(const pid_t pid, spawn(options, folder.path(), log));
  ChildResult result;
  int status = 0;
  bool stopped = false;
  rusage usage{};
  while (wait4(pid, &status, WNOHANG, &usage) == 0) {
    stopped = options.look && !options.look();
    result.timed_out = elapsed_s() > options.limit_s;
    if (stopped || result.timed_out) {
      kill(-pid, SIGKILL);
      wait4(pid, &status, 0, &usage);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(elapsed_s() < 1.0 ? 5 : 50));
  }
  if (stopped) return core::Error{core::ErrorCode::kUsage, "stopped; the same command continues"};
  result.wall_s = elapsed_s();
  for (const timeval& part : {usage.ru_utime, usage.ru_stime})
    result.cpu_s += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
  if (!result.timed_out && WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (auto text = core::read_whole_file(log); text.ok()) {
    constexpr std::size_t kKept = 4000;
    result.log = std::move(text).value();
    if (result.log.size() > kKept) result.log.erase(0, result.log.size() - kKept);
  }
  for (const std::string& name : options.wanted) {
    if (auto content = core::read_whole_file(folder.path() / name); content.ok())
      result.files.emplace_back(name, std::move(content).value());
  }
  return result;
}

}  // namespace ravencal::prove
