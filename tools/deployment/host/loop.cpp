// SPDX-License-Identifier: Apache-2.0
#include "host/loop.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "core/first_exception.hpp"
#include "core/monotonic_clock.hpp"
#include "core/run_level.hpp"

namespace ravencal::host {
namespace {

using core::monotonic_now_ns;

constexpr int kPriority = 80;  // below the kernel's own real-time threads, above everything else

std::uint32_t to_u32(std::int64_t ns) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(ns, 0, UINT32_MAX));
}

/// Data of the loop's thread, allocated and touched before it starts.
struct Work {
  std::int64_t period_ns;  ///< 0: do not wait
  std::int64_t ticks;
  plugin_host::Instance& plugin;
  RobotSource& source;
  LoopResult& result;
  std::atomic<std::int64_t> done{0};
  std::atomic<bool> stop{false};
  std::atomic<bool> finished{false};
};

Tick run_cycle(Work& work, ravencal_state& state, ravencal_output& output) {
  Tick tick;
  work.source.begin(state);
  tick.truth_ji = work.source.truth_ji();

  const std::int64_t before_ns = monotonic_now_ns();
  work.plugin.api().step(work.plugin.get(), &state, &output);
  tick.step_ns = to_u32(monotonic_now_ns() - before_ns);

  tick.state = output.state;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    tick.raw_ji[j] = state.arm[0].jpos_ji[j];
    tick.corrected_ji[j] = output.jpos_ji[j];
  }
  work.source.end(state);
  work.plugin.api().observe_cycle_end(work.plugin.get(), &state);
  return tick;
}

/// A correction begins to act while the pedal is up: it needs 0.1 s without a doubt and, at the
/// default slew, half a second for its fade.
void rest_with_pedal_up(Work& work, ravencal_state& state, ravencal_output& output) {
  constexpr std::int64_t kCycles = 1000;
  constexpr std::int64_t kCycleNs = 1'000'000;
  for (std::int64_t i = -kCycles; i < 0; ++i) {
    work.source.rest(state);
    state.t_ns += i * kCycleNs;
    state.runlevel = core::kPedalUp;
    work.plugin.api().step(work.plugin.get(), &state, &output);
    work.plugin.api().observe_cycle_end(work.plugin.get(), &state);
  }
}

void loop(Work& work) {
  ravencal_state state{};
  ravencal_output output{};
  output.struct_size = sizeof output;
  rest_with_pedal_up(work, state, output);
  std::int64_t deadline_ns = monotonic_now_ns();
  for (std::int64_t i = 0; i < work.ticks && !work.stop.load(std::memory_order_relaxed); ++i) {
    std::int64_t woke_ns = monotonic_now_ns();
    std::uint32_t wakeup_ns = 0;
    if (work.period_ns > 0) {
      deadline_ns += work.period_ns;
      if (woke_ns > deadline_ns) {  // this cycle cannot start in time any more
        ++work.result.overruns;
        deadline_ns +=
            (woke_ns - deadline_ns + work.period_ns - 1) / work.period_ns * work.period_ns;
      }
      core::sleep_until(deadline_ns);
      woke_ns = monotonic_now_ns();
      wakeup_ns = to_u32(woke_ns - deadline_ns);
    }
    Tick& tick = work.result.ticks[static_cast<std::size_t>(i)];
    tick = run_cycle(work, state, output);
    tick.wakeup_ns = wakeup_ns;
    tick.cycle_ns = to_u32(monotonic_now_ns() - woke_ns);
    work.done.store(i + 1, std::memory_order_relaxed);
  }
}

/// Asks for real-time scheduling, as a control process does. A loop that never sleeps does not ask:
/// at SCHED_FIFO the kernel would stop it for 50 ms of every second (sched_rt_runtime_us), and it
/// would block the machine in between.
void become_real_time(LoopResult& result) {
  result.memory_locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (!result.memory_locked) {
    result.hindrance = fmt::format("mlockall: {} (raise the memlock limit)", std::strerror(errno));
  }
  sched_param parameters{};
  parameters.sched_priority = kPriority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  result.real_time = error == 0;
  if (error != 0) {
    result.hindrance +=
        fmt::format("{}SCHED_FIFO {}: {} (raise the rtprio limit)",
                    result.hindrance.empty() ? "" : "; ", kPriority, std::strerror(error));
  }
}

}  // namespace

LoopResult run_loop(const LoopOptions& options, plugin_host::Instance& plugin, RobotSource& source,
                    const std::function<bool(double)>& keep_going) {
  LoopResult result;
  const std::int64_t ticks = std::min(options.ticks, source.cycles());
  result.ticks.resize(static_cast<std::size_t>(ticks));
  const bool waits = options.rate_hz > 0.0;
  const std::int64_t period_ns =
      waits ? std::llround(static_cast<double>(core::kSecondNs) / options.rate_hz) : 0;
  Work work{period_ns, ticks, plugin, source, result};
  core::FirstException thrown;
  std::jthread thread([&] {
    thrown.guard([&] {
      if (waits) {
        become_real_time(result);
      } else {
        result.hindrance = "the loop does not wait (--rate-hz 0)";
      }
      loop(work);
    });
    work.finished.store(true, std::memory_order_release);
  });
  while (!work.finished.load(std::memory_order_acquire)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ticks < 5000 ? 5 : 100));
    const auto done = static_cast<double>(work.done.load(std::memory_order_relaxed));
    if (!keep_going(done / static_cast<double>(std::max<std::int64_t>(ticks, 1)))) {
      work.stop.store(true, std::memory_order_relaxed);
    }
  }
  thread.join();
  thrown.rethrow();
  result.ticks.resize(static_cast<std::size_t>(work.done.load()));
  return result;
}

}  // namespace ravencal::host
