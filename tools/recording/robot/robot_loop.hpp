// SPDX-License-Identifier: Apache-2.0
//
// Runs a VirtualController in a thread of its own, at SCHED_FIFO where the system permits it.
// Inputs and outputs pass through wait-free rings, so the loop never waits for ROS.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "core/first_exception.hpp"
#include "core/spsc_ring.hpp"
#include "robot/virtual_controller.hpp"

namespace ravencal::robot {

struct RobotLoopOptions {
  double speed = 1.0;     ///< robot seconds per second; above 1 only for tests and tutorials
  int publish_every = 1;  ///< hands out every n-th cycle
  /// Above real time only: after so many outputs without a joint command it waits for the next
  /// command, for at most `patience_s` of the caller's clock, then goes on until commands come
  /// again. A commander that is held up would otherwise miss more robot time than any real one.
  int outputs_ahead = 3;
  double patience_s = 0.5;
};

/// A message for the loop: a button, or a joint command.
struct RobotInput {
  enum class Kind : std::uint8_t { kButton, kCommand };
  Kind kind = Kind::kButton;
  Button button = Button::kEmergencyStop;
  CrtkArm arm = CrtkArm::kArm1;
  CommandKind command = CommandKind::kRelative;
  std::array<double, 3> joints{};
};

class RobotLoop {
 public:
  RobotLoop(VirtualController controller, const RobotLoopOptions& options);
  RobotLoop(const RobotLoop&) = delete;
  RobotLoop& operator=(const RobotLoop&) = delete;
  ~RobotLoop();

  void start();
  void stop();  ///< throws what ended the loop before

  /// False once it has ended, by stop() or by itself.
  [[nodiscard]] bool running() const { return !ended_.load(std::memory_order_acquire); }

  /// One thread only. False if the loop is too far behind; the input is lost.
  bool send(const RobotInput& input) noexcept { return inputs_.try_push(input); }
  /// One thread only. False if there is nothing.
  bool receive(CycleOutput& output) noexcept { return outputs_.try_pop(output); }

  [[nodiscard]] std::int64_t cycles() const { return cycles_.load(std::memory_order_relaxed); }
  /// Wake-ups that came too late for the next one, and outputs that nobody took.
  [[nodiscard]] std::int64_t overruns() const { return overruns_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::int64_t not_taken() const {
    return not_taken_.load(std::memory_order_relaxed);
  }
  /// Why it does not run in real time; empty if it does. Valid after start().
  [[nodiscard]] const std::string& hindrance() const { return hindrance_; }

 private:
  void join();
  void become_real_time();
  void run();
  void run_cycle();
  void apply_inputs();
  void wait_for_commander();
  void apply(const RobotInput& input);

  VirtualController controller_;
  RobotLoopOptions options_;
  core::SpscRing<RobotInput> inputs_;
  core::SpscRing<CycleOutput> outputs_;
  bool commands_come_ = false;
  int outputs_since_command_ = 0;
  std::string hindrance_;  // written before started_
  std::atomic<bool> started_{false};
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  core::FirstException thrown_;
  std::atomic<std::int64_t> cycles_{0};
  std::atomic<std::int64_t> overruns_{0};
  std::atomic<std::int64_t> not_taken_{0};
  std::thread thread_;
};

}  // namespace ravencal::robot
