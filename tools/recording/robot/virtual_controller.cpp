// SPDX-License-Identifier: Apache-2.0
#include "robot/virtual_controller.hpp"

#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "core/catalogue.hpp"
#include "core/constants.hpp"
#include "physics/raven_arms.hpp"
#include "physics/raven_kinematics.hpp"
#include "physics/raven_twin.hpp"
#include "plugin_host/plugin_library.hpp"
#include "plugin_host/robot_state.hpp"

namespace ravencal::robot {
namespace {

using core::RavenField;
using Eigen::Vector3d;
using physics::RavenMessage;

// A homed robot passes through INIT in this time after the start button.
constexpr int kInitCycles = 500;

double as_float(double value) { return static_cast<double>(static_cast<float>(value)); }

}  // namespace

/// The plugin as a control process holds it; nothing if none was asked for.
struct PluginHook {
  std::optional<plugin_host::Library> library;
  std::optional<plugin_host::Instance> instance;
  ravencal_state state{};
  ravencal_output output{};

  core::Status open(const VirtualControllerOptions& options, const std::string& arm) {
    output.struct_size = sizeof output;
    if (options.plugin.empty()) return {};
    RAVENCAL_ASSIGN_OR_RETURN(library, plugin_host::Library::open(options.plugin));
    ravencal_config config = library->default_config(arm);
    config.step_budget_ns = 0;  // this machine is not the robot's
    if (options.telemetry.size() >= sizeof config.telemetry_name) {
      return core::Error{core::ErrorCode::kUsage, "--telemetry: the name is too long"};
    }
    std::memcpy(config.telemetry_name, options.telemetry.c_str(), options.telemetry.size() + 1);
    RAVENCAL_ASSIGN_OR_RETURN(instance, plugin_host::Instance::create(*library, config));
    if (!options.weights.empty()) RAVENCAL_RETURN_IF_ERROR(instance->load(options.weights));
    instance->api().enable(instance->get(), 1);
    return {};
  }

  /// Joints 1 to 3 as the controller goes on with them, as integration/controller.hpp puts them.
  /// Returns the change of the correction.
  Vector3d correct(const RavenMessage& at_hook, std::int64_t t_ns, bool homed,
                   Vector3d& measured_ji, Vector3d& desired_ji) {
    if (!instance) return Vector3d::Zero();
    plugin_host::fill_state(plugin_host::to_si(at_hook), t_ns, homed, state);
    // Not by way of the message, whose degrees round.
    Eigen::Map<Eigen::Vector3f>(state.arm[0].jpos_d_ji) = desired_ji.cast<float>();
    const Eigen::Map<const Eigen::Vector3f> correction_ji(output.correction_ji);
    const Eigen::Vector3f before_ji = correction_ji;
    if (instance->api().step(instance->get(), &state, &output) < 0) return Vector3d::Zero();
    measured_ji = Eigen::Map<const Eigen::Vector3f>(output.jpos_ji).cast<double>();
    desired_ji = Eigen::Map<const Eigen::Vector3f>(output.desired_ji).cast<double>();
    return (correction_ji - before_ji).cast<double>();
  }

  /// For the inverse cable coupling of every cycle. No desired pose is commanded here.
  [[nodiscard]] Vector3d uncorrected(const Vector3d& desired_ji) const {
    if (!instance) return desired_ji;
    const Eigen::Vector3f desired = desired_ji.cast<float>();
    Eigen::Vector3f result;
    instance->api().uncorrect_command(instance->get(), desired.data(), 0, result.data());
    return result.cast<double>();
  }

  void observe(const RavenMessage& published, std::int64_t t_ns, bool homed) {
    if (!instance) return;
    plugin_host::fill_state(plugin_host::to_si(published), t_ns, homed, state);
    instance->api().observe_cycle_end(instance->get(), &state);
  }
};

/// One arm: its twin, and what is wanted of it. Joints as the controller has them, corrected.
struct VirtualArm {
  physics::RavenTwin twin;
  JointCommands commands{};
  Vector3d measured_ji = Vector3d::Zero();
  Vector3d desired_ji = Vector3d::Zero();
  Vector3d pose_ji = Vector3d::Zero();  ///< joints of the desired pose, pos_d and ori_d
};

struct VirtualController::Impl {
  Impl(physics::RavenTwin own, physics::RavenTwin other_arm, const physics::Plant& plant)
      : arm{std::move(own)},
        other{std::move(other_arm)},
        branch(plant.robot.controller),
        gold(plant.robot.arm == "gold"),
        cycle_s(1.0 / plant.robot.control_rate_hz) {}

  void update_runlevel();
  void read_arms(std::int64_t t_ns);
  void move_desired();
  void finish_arm(VirtualArm& which, const Vector3d& motor_side_ji);
  void complete(RavenMessage& message) const;
  void write_corrected(RavenMessage& message) const;
  [[nodiscard]] OperatingState operating() const;
  /// Whether a mechanism's pose and type stand in the slots of the other arm.
  [[nodiscard]] bool mechanisms_crossed() const { return branch.green_arm_first; }

  VirtualArm arm;    ///< the plant's: with the plugin and the external encoders
  VirtualArm other;  ///< the idle one, unless somebody commands it
  PluginHook plugin;
  physics::ControllerBranch branch;
  bool gold;
  double cycle_s;
  bool emergency_stop = true;
  bool start_pressed = false;
  bool pedal_down = false;
  bool homed = false;
  std::int32_t runlevel = kEmergencyStop;
  int init_cycles = 0;
  int cycles_until_reseed = 0;
  RavenMessage at_hook{};
  CycleOutput output;
};

namespace {

/// The arm beside the plant's own: its mirror image, without payload, with random draws of its own.
core::Result<physics::RavenTwin> make_other_arm(const physics::Plant& plant,
                                                physics::TwinOptions options) {
  physics::Plant other = physics::plant_of_arm(plant, plant.robot.arm == "gold" ? "green" : "gold");
  other.payload = {};
  options.seed += 1'000'000;
  options.homing_seed += 1'000'000;
  return physics::RavenTwin::create(other, options);
}

}  // namespace

core::Result<VirtualController> VirtualController::create(const physics::Plant& given,
                                                          const VirtualControllerOptions& options) {
  physics::Plant plant = given;
  if (plant.robot.controller.name.empty())
    plant.robot.controller = *physics::find_controller_branch("crtk");
  physics::TwinOptions twin_options;
  twin_options.seed = options.seed;
  twin_options.homing_seed = options.homing_seed;
  RAVENCAL_ASSIGN_OR_RETURN(physics::RavenTwin own,
                            physics::RavenTwin::create(plant, twin_options));
  RAVENCAL_ASSIGN_OR_RETURN(physics::RavenTwin other, make_other_arm(plant, twin_options));
  auto impl = std::make_unique<Impl>(std::move(own), std::move(other), plant);
  RAVENCAL_RETURN_IF_ERROR(impl->plugin.open(options, plant.robot.arm));
  if (options.homed) {
    for (VirtualArm* arm : {&impl->arm, &impl->other}) {
      arm->twin.home();
      arm->desired_ji = arm->pose_ji = arm->twin.estimate_ji();
    }
    impl->homed = impl->arm.twin.homed() && impl->other.twin.homed();
    impl->emergency_stop = false;
    impl->runlevel = kPedalUp;
  }
  return VirtualController(std::move(impl));
}

VirtualController::VirtualController(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VirtualController::VirtualController(VirtualController&&) noexcept = default;
VirtualController& VirtualController::operator=(VirtualController&&) noexcept = default;
VirtualController::~VirtualController() = default;

double VirtualController::rate_hz() const { return 1.0 / impl_->cycle_s; }
bool VirtualController::gold() const { return impl_->gold; }

CrtkArm VirtualController::crtk_arm() const {
  const bool first = impl_->gold != impl_->branch.green_arm_first;
  return first ? CrtkArm::kArm1 : CrtkArm::kArm2;
}

void VirtualController::press(Button button) noexcept {
  Impl& robot = *impl_;
  switch (button) {
    case Button::kUnhome:
      robot.homed = false;
      [[fallthrough]];
    case Button::kEmergencyStop:
      robot.emergency_stop = true;
      return;
    case Button::kEmergencyStopRelease:
      robot.emergency_stop = false;
      return;
    case Button::kStart:
      robot.start_pressed = true;
      return;
    case Button::kPedalDown:
      robot.pedal_down = true;
      return;
    case Button::kPedalUp:
      robot.pedal_down = false;
      return;
  }
}

void VirtualController::command(CrtkArm arm, CommandKind kind, const Vector3d& joints) noexcept {
  if (impl_->runlevel != kPedalDown) return;  // CRTK state PAUSED or DISABLED
  VirtualArm& commanded = arm == crtk_arm() ? impl_->arm : impl_->other;
  commanded.commands.take(kind, joints);
}

void VirtualController::Impl::update_runlevel() {
  const std::int32_t before = runlevel;
  if (emergency_stop) {
    runlevel = kEmergencyStop;
  } else if (runlevel == kEmergencyStop && start_pressed) {
    runlevel = kInit;
    init_cycles = 0;
    if (!homed) {
      arm.twin.start_homing();
      other.twin.start_homing();
    }
  } else if (runlevel == kInit) {
    ++init_cycles;
    homed = homed || (arm.twin.homed() && other.twin.homed());
    if (homed && init_cycles >= kInitCycles) runlevel = kPedalUp;
  }
  start_pressed = false;
  if (runlevel == kPedalUp || runlevel == kPedalDown) runlevel = pedal_down ? kPedalDown : kPedalUp;
  if (runlevel == before) return;
  arm.commands.forget();
  other.commands.forget();
}

OperatingState VirtualController::Impl::operating() const {
  switch (runlevel) {
    case kInit:
    case kPedalDown:
      return OperatingState::kEnabled;
    case kPedalUp:
      return OperatingState::kPaused;
    default:
      return OperatingState::kDisabled;
  }
}

/// What the twin, one arm alone, cannot know.
void VirtualController::Impl::complete(RavenMessage& message) const {
  message[core::catalogue_index(RavenField::kRunlevel, 0)] = runlevel;
  message[core::catalogue_index(RavenField::kSublevel, 0)] = homed ? branch.sublevel_when_homed : 0;
}

/// The corrected joints and all that the controller computes from them.
void VirtualController::Impl::write_corrected(RavenMessage& message) const {
  physics::SlotVector joints{};
  for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
    double& value = message[core::catalogue_index(RavenField::kJpos, slot)];
    const auto n = static_cast<Eigen::Index>(slot);
    if (slot < 3) {
      value = as_float(arm.measured_ji[n] * core::kDegPerRad);
      message[core::catalogue_index(RavenField::kJposD, slot)] =
          as_float(arm.desired_ji[n] * core::kDegPerRad);
    }
    joints[slot] = value / core::kDegPerRad;
  }
  const auto write_pose = [&](RavenField position, RavenField rotation) {
    const physics::ToolPose pose =
        physics::forward_kinematics(gold ? physics::Arm::kGold : physics::Arm::kGreen, joints);
    for (std::size_t i = 0; i < 3; ++i) {
      message[core::catalogue_index(position, i, mechanisms_crossed())] =
          static_cast<double>(pose.position_um[i]);
    }
    for (std::size_t i = 0; i < 9; ++i) {
      message[core::catalogue_index(rotation, i, mechanisms_crossed())] =
          as_float(pose.rotation[i]);
    }
  };
  write_pose(RavenField::kPos, RavenField::kOri);
  for (std::size_t i = 0; i < 3; ++i) joints[i] = arm.pose_ji[static_cast<Eigen::Index>(i)];
  write_pose(RavenField::kPosD, RavenField::kOriD);
}

/// Sensors of both arms, and the correction at the hook.
void VirtualController::Impl::read_arms(std::int64_t t_ns) {
  other.twin.begin_cycle();
  other.measured_ji = other.twin.estimate_ji();
  arm.twin.show_other_arm(other.twin.arm_state());
  at_hook = arm.twin.begin_cycle();
  complete(at_hook);
  arm.measured_ji = arm.twin.estimate_ji();
  const Vector3d change_ji = plugin.correct(at_hook, t_ns, homed, arm.measured_ji, arm.desired_ji);
  if (runlevel == kInit) arm.pose_ji += change_ji;
}

/// Desired joints of this cycle, as the branch's joint and Cartesian control leave them. Inverse
/// and forward kinematics are each other's inverse here: a pose is kept as its joints.
void VirtualController::Impl::move_desired() {
  const std::array<VirtualArm*, 2> both = {&arm, &other};
  if (!homed) {
    for (VirtualArm* each : both) each->desired_ji = each->pose_ji = each->measured_ji;
    return;
  }
  if (runlevel < kPedalUp) return;
  const bool pedal_up = runlevel == kPedalUp;
  const bool commanded = arm.commands.pending() || other.commands.pending();
  for (VirtualArm* each : both) {
    if (commanded || pedal_up) each->pose_ji = each->measured_ji;
    each->desired_ji = each->commands.advance(each->desired_ji, cycle_s);
  }
  if (commanded) {
    cycles_until_reseed = branch.cycles_to_reseed;
  } else if (cycles_until_reseed > 0) {
    --cycles_until_reseed;
  } else if (pedal_up || branch.cycles_to_reseed > 0) {
    for (VirtualArm* each : both) each->desired_ji = each->pose_ji;
  }
}

/// The control law of this run level for one arm, whose motors follow `motor_side_ji`.
void VirtualController::Impl::finish_arm(VirtualArm& which, const Vector3d& motor_side_ji) {
  if (runlevel == kPedalDown) {
    which.twin.end_cycle(motor_side_ji);
  } else if (runlevel != kInit || homed) {
    which.twin.end_braked_cycle(runlevel == kPedalUp);
  } else if (!which.twin.homed()) {
    which.twin.end_homing_cycle();
  } else {  // waits at home for the other arm
    const physics::SlotVector& home = which.twin.arm_state().jpos_d_ji;
    which.twin.end_cycle({home[0], home[1], home[2]});
  }
}

const CycleOutput& VirtualController::cycle() noexcept {
  Impl& robot = *impl_;
  robot.update_runlevel();
  const std::int64_t t_ns = robot.arm.twin.t_ns();
  robot.read_arms(t_ns);
  const physics::Truth truth = robot.arm.twin.truth();
  robot.move_desired();
  robot.finish_arm(robot.other, robot.other.desired_ji);
  robot.arm.twin.show_other_arm(robot.other.twin.arm_state());
  robot.finish_arm(robot.arm, robot.plugin.uncorrected(robot.arm.desired_ji));

  CycleOutput& out = robot.output;
  out.message = robot.arm.twin.message();
  robot.complete(out.message);
  robot.plugin.observe(out.message, t_ns, robot.homed);  // without the correction
  if (robot.runlevel != kInit || robot.homed) robot.write_corrected(out.message);
  out.t_ns = t_ns;
  out.runlevel = robot.runlevel;
  out.operating = robot.operating();
  out.homed = robot.homed;
  out.busy = robot.runlevel == kInit;
  for (std::size_t i = 0; i < 3; ++i) {
    out.encoders_ji[i] = truth.encoder_ji[static_cast<Eigen::Index>(i)];
    out.encoder_counts[i] = truth.encoder_counts[i];
    out.correction_ji[i] = static_cast<double>(robot.plugin.output.correction_ji[i]);
  }
  return out;
}

}  // namespace ravencal::robot
