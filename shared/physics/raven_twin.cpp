// SPDX-License-Identifier: Apache-2.0
#include "physics/raven_twin.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "core/constants.hpp"
#include "core/random.hpp"
#include "core/run_level.hpp"
#include "physics/arm_physics.hpp"
#include "physics/effects/quantisation.hpp"
#include "physics/raven_controller.hpp"

namespace ravencal::physics {
namespace {

using core::JointSlot;
using Eigen::Index;
using Eigen::Vector3d;

constexpr int kHomingTimeoutCycles = 120'000;  // two minutes; the slowest joint needs some 15 s

Arm arm_of(const Plant& plant) { return plant.robot.arm == "green" ? Arm::kGreen : Arm::kGold; }

core::Status check_plant(const Plant& plant) {
  const auto fail = [&](const std::string& why) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: {}", plant.source, why)};
  };
  if (plant.robot.arm != "gold" && plant.robot.arm != "green") {
    return fail(fmt::format("robot.arm '{}' is not gold or green", plant.robot.arm));
  }
  if (plant.joints.size() != 3) {
    return fail(fmt::format("the RAVEN twin needs 3 joints, found {}", plant.joints.size()));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Joint& joint = plant.joints[i];
    if (joint.name != core::kSlotNames[i]) {
      return fail(
          fmt::format("joint {} must be '{}', found '{}'", i + 1, core::kSlotNames[i], joint.name));
    }
    if ((joint.kind == JointKind::kPrismatic) != (i == 2)) {
      return fail(fmt::format("joint '{}' is of the wrong kind", joint.name));
    }
    if (!joint.controller || !joint.homing) {
      return fail(fmt::format("joint '{}' needs a controller and a homing table", joint.name));
    }
    if (joint.drive.input != "torque_n_m" || joint.drive.dac_counts_per_n_m == 0.0) {
      return fail(
          fmt::format("joint '{}': the twin drives torque_n_m through a DAC "
                      "(drive.dac_counts_per_n_m)",
                      joint.name));
    }
    if (joint.external_load) {
      return fail(
          fmt::format("joint '{}': the twin records no load from outside ([joint.external_load]; "
                      "simulate --follow replays a recorded one)",
                      joint.name));
    }
    for (const Effect& effect : joint.effects) {
      if (effect.id == "delay" || (effect.id != "coupling" && !effect.from.empty()) ||
          effect.parameters.contains("half_loop") || effect.parameters.contains("stretch") ||
          effect.parameters.contains("lag")) {
        return fail(
            fmt::format("joint '{}': {} in a form that holds without a cable; the twin has "
                        "cables (simulate --follow runs it)",
                        joint.name, effect.id));
      }
    }
    if (!(joint.link.mass_kg > 0.0) || !(joint.joint_encoder_resolution_ji > 0.0) ||
        !(joint.motor_inertia_kg_m2 > kNoInertia_kg_m2)) {
      return fail(
          fmt::format("joint '{}': link.mass_kg, motor_inertia_kg_m2 and the joint encoder's "
                      "resolution must be above zero",
                      joint.name));
    }
  }
  return {};
}

/// The other arm: homed, parked with brakes on, its encoders still.
ArmState parked_arm(Arm arm, const Plant& plant, core::Random& random) {
  RavenController controller(plant, arm);
  SlotCounts counts{};
  for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
    counts[slot] = static_cast<std::int64_t>(random.uniform(-2e5, 2e5));
  }
  const Vector3d joints(30.0 * core::kRadPerDeg, 90.0 * core::kRadPerDeg, 0.40);
  const Vector3d arm_motors = motors_from_joints(plant, joints);
  SlotVector motors = {arm_motors[0], arm_motors[1], arm_motors[2]};
  tool_motors_from_joints(
      arm, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 45.0 * core::kRadPerDeg, 45.0 * core::kRadPerDeg},
      motors);
  for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
    const double counts_per_rad = plant.sensors.motor_encoder_counts_per_rev / core::kRadPerTurn;
    const double signed_counts = controller.encoder_sign(slot) * static_cast<double>(counts[slot]);
    controller.set_encoder_offset(
        static_cast<JointSlot>(slot),
        static_cast<std::int64_t>(signed_counts - motors[slot] * counts_per_rad));
  }
  controller.read_sensors(counts);
  controller.control(joints);
  ArmState state = controller.state();
  state.dac = {};
  state.tau_n_m = {};
  return state;
}

}  // namespace

struct RavenTwin::Impl {
  Impl(const Plant& plant_in, ArmPhysics physics_in, const TwinOptions& options_in)
      : plant(plant_in),
        options(options_in),
        arm(arm_of(plant)),
        physics(std::move(physics_in)),
        controller(plant, arm),
        run_random(options.seed * 2 + 1),
        power_on_random(options.homing_seed * 2) {
    for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
      power_on_counts[slot] = static_cast<std::int64_t>(power_on_random.uniform(-2e5, 2e5));
    }
    other = parked_arm(arm == Arm::kGold ? Arm::kGreen : Arm::kGold, plant, power_on_random);
    Vector3d start;
    for (Index i = 0; i < 3; ++i) {
      const Joint& joint = plant.joints[static_cast<std::size_t>(i)];
      const double spread = joint.kind == JointKind::kRevolute ? 0.05 : 0.01;
      start[i] = joint.homing->home_ji + power_on_random.uniform(-spread, spread);
    }
    physics.place(start);
    motors_before_rad = physics.motors_rad();
    physics.restart_disturbances(run_random);
    read_encoders();
    write_status_fields(0.0, core::kPedalDown, 0, published);
    write_sensor_fields(other, true, published);
    write_control_fields(other, true, published);
    if (plant.robot.controller.green_arm_first) swap_mechanism_fields(published);
  }

  /// Raw counts: motors of joints 1 to 3 as they turn, tool motors where the controller wants them.
  void read_encoders() {
    const double counts_per_rad = plant.sensors.motor_encoder_counts_per_rev / core::kRadPerTurn;
    SlotCounts counts = power_on_counts;
    const Vector3d& motors = plant.robot.controller.reads_encoders_before_sleep
                                 ? motors_before_rad
                                 : physics.motors_rad();
    for (std::size_t i = 0; i < 3; ++i) {
      const auto turned = encoder_counts(motors[static_cast<Index>(i)], 1.0 / counts_per_rad);
      counts[i] += static_cast<std::int64_t>(controller.encoder_sign(i)) * turned;
    }
    const SlotVector tool = controller.tool_motors_rad();
    for (std::size_t slot = 4; slot < core::kSlotCount; ++slot) {
      const double sign = controller.encoder_sign(slot);
      const auto offset = static_cast<double>(controller.state().encoder_offset[slot]);
      counts[slot] =
          static_cast<std::int64_t>(sign * std::round(tool[slot] * counts_per_rad + offset));
    }
    controller.read_sensors(counts);
  }

  void advance(core::Random& random) {
    motors_before_rad = physics.motors_rad();
    physics.advance(controller.commanded_torque_n_m(), random);
    ++cycle;
  }

  /// One cycle of the homing sequence after its sensors have been read.
  void home_cycle(bool watched) {
    const bool done = controller.home_step();
    if (watched) publish();
    advance(*homing_random);
    if (done) finish_homing();
  }

  void finish_homing() {
    if (!homing_random) return;
    homing_random.reset();
    ever_homed = true;
    physics.restart_disturbances(run_random);
  }

  void publish() {
    write_status_fields(static_cast<double>(t_ns()) * 1e-9, core::kPedalDown, sublevel(),
                        published);
    write_sensor_fields(controller.state(), false, published);
    write_control_fields(controller.state(), false, published);
    write_sensor_fields(other, true, published);
    write_control_fields(other, true, published);
    if (plant.robot.controller.green_arm_first) swap_mechanism_fields(published);
  }

  [[nodiscard]] int sublevel() const {
    const bool homed = ever_homed && controller.homed();
    return homed ? plant.robot.controller.sublevel_when_homed : 0;
  }

  [[nodiscard]] std::int64_t t_ns() const {
    return static_cast<std::int64_t>(
        std::llround(static_cast<double>(cycle) * 1e9 / plant.robot.control_rate_hz));
  }

  /// What a homing does beside driving joints 1 to 3 to their stops (Robot::rehoming_shift_counts).
  void shift_encoders(core::Random& random) {
    const double shift = plant.robot.rehoming_shift_counts;
    if (homings == 1 || shift == 0.0) return draw_other_offsets(random);
    if (homings > 2) return;
    for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
      const auto counts = static_cast<std::int64_t>(random.uniform(-shift, shift));
      power_on_counts[slot] += counts;
      // Tool joints find their stops again; nothing homes the void slot.
      if (slot < 4) continue;
      const auto sign = static_cast<std::int64_t>(controller.encoder_sign(slot));
      controller.set_encoder_offset(static_cast<JointSlot>(slot),
                                    controller.state().encoder_offset[slot] + sign * counts);
    }
    read_encoders();  // homing starts from what they say now
  }

  /// Offsets of the slots without a dynamic joint: tool and void.
  void draw_other_offsets(core::Random& random) {
    for (const JointSlot slot : {JointSlot::kVoid, JointSlot::kRoll, JointSlot::kWrist,
                                 JointSlot::kGrasp1, JointSlot::kGrasp2}) {
      controller.set_encoder_offset(slot, static_cast<std::int64_t>(random.uniform(-2e5, 2e5)));
    }
  }

  Plant plant;
  TwinOptions options;
  Arm arm;
  ArmPhysics physics;
  RavenController controller;
  ArmState other;
  Vector3d motors_before_rad = Vector3d::Zero();  ///< shafts at the end of the last cycle's output
  SlotCounts power_on_counts{};
  core::Random run_random;
  core::Random power_on_random;
  std::optional<core::Random> homing_random;  ///< only while homing
  std::uint64_t homings = 0;
  bool ever_homed = false;
  std::int64_t cycle = 0;
  RavenMessage published{};
  RavenMessage at_hook{};
};

core::Result<RavenTwin> RavenTwin::create(const Plant& plant, std::uint64_t seed) {
  TwinOptions options;
  options.seed = seed;
  return create(plant, options);
}

core::Result<RavenTwin> RavenTwin::create(const Plant& plant, const TwinOptions& options) {
  RAVENCAL_RETURN_IF_ERROR(check_plant(plant));
  RAVENCAL_ASSIGN_OR_RETURN(ArmPhysics physics, ArmPhysics::create(plant, options.drift));
  return RavenTwin(std::make_unique<Impl>(plant, std::move(physics), options));
}

RavenTwin::RavenTwin(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RavenTwin::RavenTwin(RavenTwin&&) noexcept = default;
RavenTwin& RavenTwin::operator=(RavenTwin&&) noexcept = default;
RavenTwin::~RavenTwin() = default;

void RavenTwin::home(const std::function<void()>& each_cycle) {
  start_homing();
  for (int i = 0; i < kHomingTimeoutCycles && impl_->homing_random; ++i) {
    impl_->read_encoders();
    if (each_cycle) each_cycle();
    impl_->home_cycle(false);
  }
  impl_->finish_homing();
}

void RavenTwin::start_homing() {
  Impl& twin = *impl_;
  // A stream of its own, so that equal homing seeds give equal offsets whatever the run's seed is.
  core::Random random((twin.options.homing_seed * 1'000'003 + ++twin.homings) * 2);
  twin.physics.draw_stop_seats(random);
  twin.physics.restart_disturbances(random);
  twin.shift_encoders(random);
  twin.controller.start_homing();
  twin.homing_random = random;
}

const RavenMessage& RavenTwin::end_homing_cycle() {
  if (impl_->homing_random) impl_->home_cycle(true);
  return impl_->published;
}

bool RavenTwin::homed() const { return impl_->ever_homed && impl_->controller.homed(); }

Vector3d RavenTwin::estimate_ji() const {
  const SlotVector& jpos = impl_->controller.state().jpos_ji;
  return {jpos[0], jpos[1], jpos[2]};
}

const RavenMessage& RavenTwin::begin_cycle() {
  Impl& twin = *impl_;
  twin.read_encoders();
  twin.at_hook = twin.published;
  write_status_fields(static_cast<double>(t_ns()) * 1e-9, core::kPedalDown, twin.sublevel(),
                      twin.at_hook);
  write_sensor_fields(twin.controller.state(), false, twin.at_hook);
  write_sensor_fields(twin.other, true, twin.at_hook);
  clear_dac_fields(twin.at_hook);
  return twin.at_hook;
}

const RavenMessage& RavenTwin::end_cycle(const Vector3d& desired_ji) {
  Impl& twin = *impl_;
  twin.controller.control(desired_ji);
  twin.publish();
  twin.advance(twin.run_random);
  return twin.published;
}

const RavenMessage& RavenTwin::end_braked_cycle(bool pedal_up) {
  Impl& twin = *impl_;
  twin.controller.rest(estimate_ji(), pedal_up);
  twin.publish();
  twin.motors_before_rad = twin.physics.motors_rad();
  ++twin.cycle;
  return twin.published;
}

const RavenMessage& RavenTwin::message() const { return impl_->published; }

const ArmState& RavenTwin::arm_state() const { return impl_->controller.state(); }

void RavenTwin::show_other_arm(const ArmState& other) { impl_->other = other; }

Truth RavenTwin::truth() const {
  Truth truth;
  truth.joints_ji = impl_->physics.joints_ji();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto n = static_cast<Index>(i);
    const double resolution = impl_->plant.joints[i].joint_encoder_resolution_ji;
    truth.encoder_counts[i] = encoder_counts(truth.joints_ji[n], resolution);
    truth.encoder_ji[n] = static_cast<double>(truth.encoder_counts[i]) * resolution;
  }
  return truth;
}

std::int64_t RavenTwin::t_ns() const { return impl_->t_ns(); }

}  // namespace ravencal::physics
