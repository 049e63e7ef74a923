// SPDX-License-Identifier: Apache-2.0
#include "bench/step_calls.hpp"

#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>

#include "rt/alarm.hpp"

namespace ravencal::bench {
namespace {

constexpr int kSteps = 200;

void run_steps(const Peer& peer) {
  std::array<float, 16> outputs;
  for (int i = 0; i < kSteps; ++i) {
    if (peer.prepare) peer.prepare();
    peer.step(outputs.data());
  }
}

/// The child: stops, then runs the steps between two calls of getppid, which nobody else makes.
[[noreturn]] void run_traced(const Peer& peer) {
  if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(2);
  raise(SIGSTOP);
  syscall(SYS_getppid);
  run_steps(peer);
  syscall(SYS_getppid);
  _exit(0);
}

/// System calls of a stopped child between its two marks; nothing if it ended or never stopped.
std::optional<int> count_between_marks(pid_t child) {
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return std::nullopt;
  ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
  int marks = 0;
  int calls = 0;
  while (marks < 2) {
    ptrace(PTRACE_SYSCALL, child, nullptr, nullptr);
    if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return std::nullopt;
    if (WSTOPSIG(status) != (SIGTRAP | 0x80)) continue;
    __ptrace_syscall_info info = {};
    ptrace(PTRACE_GET_SYSCALL_INFO, child, sizeof info, &info);
    if (info.op != PTRACE_SYSCALL_INFO_ENTRY) continue;
    const bool is_mark = info.entry.nr == SYS_getppid;
    marks += is_mark ? 1 : 0;
    calls += !is_mark && marks == 1 ? 1 : 0;
  }
  return calls;
}

}  // namespace

double heap_calls_per_step(const Peer& peer) {
  run_steps(peer);
  test::arm_heap_alarm();
  run_steps(peer);
  return static_cast<double>(test::disarm_heap_alarm()) / kSteps;
}

std::optional<double> system_calls_per_step(const Peer& peer) {
  const pid_t child = fork();
  if (child < 0) return std::nullopt;
  if (child == 0) run_traced(peer);
  const std::optional<int> calls = count_between_marks(child);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  if (!calls) return std::nullopt;
  return static_cast<double>(*calls) / kSteps;
}

}  // namespace ravencal::bench
