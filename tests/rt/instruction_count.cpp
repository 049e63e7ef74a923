// SPDX-License-Identifier: Apache-2.0
#include "rt/instruction_count.hpp"

#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace ravencal::test {
namespace {

[[noreturn]] void run_traced(int count, const std::function<void(int)>& setup,
                             const std::function<void(int)>& piece) {
  if (::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) ::_exit(1);
  for (int i = 0; i < count; ++i) {
    setup(i);
    ::raise(SIGSTOP);
    piece(i);
    ::raise(SIGSTOP);
  }
  ::_exit(0);
}

/// Waits for the child; true if it stopped for this signal.
bool stopped_by(pid_t child, int signal) {
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFSTOPPED(status) && WSTOPSIG(status) == signal;
}

/// From one mark to the next.
bool count_to_mark(pid_t child, std::uint64_t& count) {
  for (count = 0;; ++count) {
    if (::ptrace(PTRACE_SINGLESTEP, child, nullptr, nullptr) != 0) return false;
    int status = 0;
    if (::waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return false;
    if (WSTOPSIG(status) == SIGSTOP) return true;
    if (WSTOPSIG(status) != SIGTRAP) return false;
  }
}

}  // namespace

std::vector<std::uint64_t> count_instructions(int count, const std::function<void(int)>& setup,
                                              const std::function<void(int)>& piece) {
  const pid_t child = ::fork();
  if (child == 0) run_traced(count, setup, piece);
  if (child < 0) return {};
  std::vector<std::uint64_t> counts;
  for (int i = 0; i < count; ++i) {
    std::uint64_t instructions = 0;
    if (!stopped_by(child, SIGSTOP) || !count_to_mark(child, instructions)) break;
    counts.push_back(instructions);
    ::ptrace(PTRACE_CONT, child, nullptr, nullptr);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return counts.size() == static_cast<std::size_t>(count) ? counts : std::vector<std::uint64_t>{};
}

}  // namespace ravencal::test
