// SPDX-License-Identifier: Apache-2.0
#include "robot/robot_loop.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/monotonic_clock.hpp"

namespace ravencal::robot {
namespace {

constexpr std::int64_t kShortestWakeNs = 1'000'000;  // several cycles a wake-up above real time
constexpr std::int64_t kLookNs = 200'000;            // while it waits for a command
constexpr std::size_t kInputs = 4096;
constexpr std::size_t kOutputs = 2048;
constexpr int kPriority = 80;  // below the kernel's own real-time threads

}  // namespace

RobotLoop::RobotLoop(VirtualController controller, const RobotLoopOptions& options)
    : controller_(std::move(controller)), options_(options), inputs_(kInputs), outputs_(kOutputs) {}

RobotLoop::~RobotLoop() { join(); }

void RobotLoop::start() {
  thread_ = std::thread([this] {
    thrown_.guard([this] {
      become_real_time();
      started_.store(true, std::memory_order_release);
      run();
    });
    ended_.store(true, std::memory_order_release);
  });
  while (!started_.load(std::memory_order_acquire) && running()) std::this_thread::yield();
}

void RobotLoop::become_real_time() {
  // Faster than real time it would keep others from the processor.
  if (options_.speed > 1.0) {
    hindrance_ = fmt::format("{} times as fast as real time", options_.speed);
    return;
  }
  sched_param parameters{};
  parameters.sched_priority = kPriority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) return;
  hindrance_ =
      fmt::format("SCHED_FIFO {}: {} (raise the rtprio limit)", kPriority, std::strerror(error));
}

void RobotLoop::stop() {
  join();
  thrown_.rethrow();
}

void RobotLoop::join() {
  stop_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

void RobotLoop::run() {
  const double cycle_ns = 1e9 / (controller_.rate_hz() * options_.speed);
  const auto cycles_per_wake =
      std::max<std::int64_t>(1, std::llround(static_cast<double>(kShortestWakeNs) / cycle_ns));
  const auto period_ns = std::llround(cycle_ns * static_cast<double>(cycles_per_wake));
  std::int64_t deadline_ns = core::monotonic_now_ns();
  while (!stop_.load(std::memory_order_relaxed)) {
    deadline_ns += period_ns;
    const std::int64_t awake_ns = core::monotonic_now_ns();
    if (awake_ns > deadline_ns) {
      // As the robot's own loop, it leaves out what it missed: robot time stands still meanwhile.
      overruns_.fetch_add(1, std::memory_order_relaxed);
      deadline_ns = awake_ns;
    } else {
      core::sleep_until(deadline_ns);
    }
    apply_inputs();
    if (options_.speed > 1.0 && commands_come_ &&
        outputs_since_command_ >= options_.outputs_ahead) {
      wait_for_commander();
      deadline_ns = core::monotonic_now_ns();
    }
    for (std::int64_t i = 0; i < cycles_per_wake; ++i) run_cycle();
  }
}

void RobotLoop::wait_for_commander() {
  const std::int64_t begun_ns = core::monotonic_now_ns();
  const auto patience_ns = std::llround(1e9 * options_.patience_s);
  while (outputs_since_command_ > 0 && !stop_.load(std::memory_order_relaxed)) {
    const std::int64_t now_ns = core::monotonic_now_ns();
    commands_come_ = now_ns - begun_ns < patience_ns;
    if (!commands_come_) return;
    core::sleep_until(now_ns + kLookNs);
    apply_inputs();
  }
}

void RobotLoop::apply_inputs() {
  RobotInput input;
  while (inputs_.try_pop(input)) apply(input);
}

void RobotLoop::run_cycle() {
  const CycleOutput& output = controller_.cycle();
  const std::int64_t number = cycles_.fetch_add(1, std::memory_order_relaxed);
  if (number % options_.publish_every != 0) return;
  ++outputs_since_command_;
  if (!outputs_.try_push(output)) not_taken_.fetch_add(1, std::memory_order_relaxed);
}

void RobotLoop::apply(const RobotInput& input) {
  if (input.kind == RobotInput::Kind::kButton) {
    controller_.press(input.button);
  } else {
    commands_come_ = true;
    outputs_since_command_ = 0;
    controller_.command(input.arm, input.command,
                        {input.joints[0], input.joints[1], input.joints[2]});
  }
}

}  // namespace ravencal::robot
