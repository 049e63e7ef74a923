// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.hpp"

#include <unistd.h>

#include <csignal>
#include <ctime>
#include <initializer_list>

#include "core/outputs.hpp"

namespace ravencal::cli {
namespace {

volatile std::sig_atomic_t stop_signal = 0;  // the first that asked to stop
timespec stopped_at = {};                    // when it came (CLOCK_MONOTONIC)
volatile std::sig_atomic_t is_work = 0;

int exit_code_of(int signal_number) { return 128 + signal_number; }  // as shells have it

void end_process(int signal_number) {
  core::remove_unfinished();
  ::_exit(exit_code_of(signal_number));
}

void ask_to_stop(int signal_number) {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (stop_signal == 0) {
    stopped_at = now;
    stop_signal = signal_number;
    return;
  }
  const auto since_s = static_cast<double>(now.tv_sec - stopped_at.tv_sec) +
                       1e-9 * static_cast<double>(now.tv_nsec - stopped_at.tv_nsec);
  if (since_s >= kSecondSignal_s) end_process(signal_number);
}

void handle(std::initializer_list<int> signals, void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  // One handler at a time: ask_to_stop reads what it wrote.
  for (const int signal_number : signals) sigaddset(&action.sa_mask, signal_number);
  for (const int signal_number : signals) sigaction(signal_number, &action, nullptr);
}

}  // namespace

void end_cleanly_at_signals() {
  handle({SIGINT, SIGTERM}, end_process);
  struct sigaction hangup = {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) handle({SIGHUP}, end_process);  // nohup(1) ignores it
}

void catch_interrupts() { handle({SIGINT, SIGTERM}, ask_to_stop); }

void catch_interrupts_of_work() {
  is_work = 1;
  catch_interrupts();
}

bool interrupted() { return stop_signal != 0; }

int exit_code_of_interrupt() {
  return is_work != 0 && stop_signal != 0 ? exit_code_of(stop_signal) : 0;
}

}  // namespace ravencal::cli
