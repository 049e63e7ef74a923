// SPDX-License-Identifier: Apache-2.0
//
// What SIGINT (Ctrl-C), SIGTERM and SIGHUP do to a program. Each removes what is unfinished
// (core/outputs.hpp) and ends the process with the exit code 128 + its number, unless the program
// asks to stop by itself.
#pragma once

namespace ravencal::cli {

/// A signal that comes within this time of the first repeats it: timeout(1) and wrappers that pass
/// on a Ctrl-C of the terminal signal a process twice at once. A person takes longer.
inline constexpr double kSecondSignal_s = 0.5;

/// For every program, before its first output.
void end_cleanly_at_signals();

/// From here on the first SIGINT or SIGTERM only sets interrupted(), so that a recorder or a
/// service comes to its end, which is a normal one; another after kSecondSignal_s ends the process.
void catch_interrupts();

/// The same for work that has a result, which the signal cuts short: exit_code_of_interrupt()
/// says so.
void catch_interrupts_of_work();

/// True once the user asked to stop.
bool interrupted();

/// 130 (SIGINT) or 143 (SIGTERM) if work was cut short, else 0.
int exit_code_of_interrupt();

}  // namespace ravencal::cli
