// SPDX-License-Identifier: Apache-2.0
//
// The virtual robot's loop above real time, with a commander that the system holds up.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <utility>

#include "robot/robot_loop.hpp"
#include "unit/robot_rig.hpp"

namespace ravencal::test {
namespace {

using robot::Button;
using robot::CommandKind;
using robot::CycleOutput;
using robot::RobotInput;
using robot::RobotLoop;
using robot::RobotLoopOptions;
using robot::VirtualController;
using robot::VirtualControllerOptions;

constexpr double kSpeed = 10.0;
constexpr int kCyclesPerOutput = 10;

/// The homed robot of branch crtk at ten times real time, its pedal down. As in `ravencal robot`,
/// desired joints outlast ten times as many cycles without a command.
class FastRobot {
 public:
  explicit FastRobot(double patience_s)
      : loop_(make_controller(),
              {.speed = kSpeed, .publish_every = kCyclesPerOutput, .patience_s = patience_s}) {
    RobotInput input;
    input.button = Button::kPedalDown;
    (void)loop_.send(input);
    loop_.start();
  }
  ~FastRobot() { loop_.stop(); }

  CycleOutput next_output() {
    CycleOutput output;
    while (!loop_.receive(output)) std::this_thread::sleep_for(std::chrono::microseconds(100));
    return output;
  }

  void move_elbow(double by_rad) {
    RobotInput input;
    input.kind = RobotInput::Kind::kCommand;
    input.arm = arm_;
    input.command = CommandKind::kRelative;
    input.joints = {0.0, by_rad, 0.0};
    (void)loop_.send(input);
  }

 private:
  VirtualController make_controller() {
    physics::Plant plant = plant_of_branch("crtk");
    plant.robot.controller.cycles_to_reseed *= static_cast<int>(kSpeed);
    VirtualControllerOptions options;
    options.homed = true;
    auto made = VirtualController::create(plant, options);
    VirtualController controller = std::move(made).value();
    arm_ = controller.crtk_arm();
    return controller;
  }

  robot::CrtkArm arm_{};
  RobotLoop loop_;
};

double desired_elbow_rad(const CycleOutput& output) { return view_of(output).desired_ji[1]; }

TEST(RobotLoop, FasterThanRealTimeForgetsNoCommandOfASlowCommander) {
  constexpr double kStepRad = 0.001;
  constexpr int kSteps = 30;
  FastRobot robot(/*patience_s=*/1000.0);
  CycleOutput output = robot.next_output();
  while (output.runlevel != 3) output = robot.next_output();
  const double start_rad = desired_elbow_rad(output);
  for (int step = 0; step < kSteps; ++step) {
    robot.move_elbow(kStepRad);
    // The system gives the processor to others: 200 cycles at this speed, twice what the controller
    // waits before it sets the desired joints to the measured ones.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const std::int64_t sent_ns = output.t_ns;
    while (desired_elbow_rad(output) < start_rad + (step + 0.5) * kStepRad) {
      output = robot.next_output();
      ASSERT_LT(output.t_ns, sent_ns + 1'000'000'000) << "step " << step << " was forgotten";
    }
  }
  EXPECT_NEAR(desired_elbow_rad(output) - start_rad, kSteps * kStepRad, 0.1 * kStepRad);
}

TEST(RobotLoop, FasterThanRealTimeGoesOnWithoutACommander) {
  FastRobot robot(/*patience_s=*/0.01);
  robot.move_elbow(0.001);
  CycleOutput output;
  for (int i = 0; i < 50; ++i) output = robot.next_output();
  EXPECT_GT(output.t_ns, 400'000'000);
}

}  // namespace
}  // namespace ravencal::test
