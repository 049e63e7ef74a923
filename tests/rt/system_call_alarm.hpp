// SPDX-License-Identifier: Apache-2.0
//
// Ends a process at the first system call that a thread of it makes: Linux seccomp, strict but for
// the exit. Used in a child process, so that the test survives.
#pragma once

#include <sys/syscall.h>

#include <cstdint>
#include <functional>

namespace ravencal::test {

/// From here on, any system call of this thread ends the process with SIGSYS, but for exit_group
/// and `allowed` (SYS_*). It cannot be undone. False if the kernel has no seccomp filters.
[[nodiscard]] bool forbid_system_calls(std::uint32_t allowed = SYS_exit_group);

struct ChildEnd {
  bool called_system = false;  ///< ended by the alarm
  int exit_code = -1;          ///< if it ended by itself
};

/// Forks, runs `work` in the child and ends it there with what it returns.
ChildEnd run_in_child(const std::function<int()>& work);

}  // namespace ravencal::test
