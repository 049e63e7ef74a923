// SPDX-License-Identifier: Apache-2.0
#include "robot/virtual_controller.hpp"

#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <utility>

#include "core/catalogue.hpp"
#include "host/plugin_library.hpp"
#include "host/robot_state.hpp"
#include "physics/raven_kinematics.hpp"
#include "physics/raven_twin.hpp"

namespace ravencal::robot {
namespace {

using core::RavenField;
using Eigen::Vector3d;
using physics::RavenMessage;

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr int kGoldArm = 0;  // types of the CRTK branch's defines.h
constexpr int kGreenArm = 1;
// A homed robot passes through INIT in this time after the start button.
constexpr int kInitCycles = 500;

// Fields that raven_state takes from mech[0] and mech[1] instead of from the joints' types. On the
// CRTK branch mech[0] is the green arm (boards are sorted by name, descending).
constexpr std::array kMechanismFields = {
    RavenField::kType, RavenField::kPos,    RavenField::kOri,    RavenField::kOriD,
    RavenField::kPosD, RavenField::kGraspD, RavenField::kJacVel, RavenField::kJacF};

void swap_mechanism_fields(RavenMessage& message) {
  for (const RavenField field : kMechanismFields) {
    for (std::size_t i = 0; i < core::info_of(field).count; ++i) {
      std::swap(message[core::catalogue_index(field, i)],
                message[core::catalogue_index(field, i, true)]);
    }
  }
}

double as_float(double value) { return static_cast<double>(static_cast<float>(value)); }

}  // namespace

/// The plugin as a control process holds it; nothing if none was asked for.
struct PluginHook {
  std::optional<host::PluginLibrary> library;
  std::optional<host::PluginInstance> instance;
  ravencal_state state{};
  ravencal_output output{};

  core::Status open(const VirtualControllerOptions& options) {
    output.struct_size = sizeof output;
    if (options.plugin.empty()) return {};
    RAVENCAL_ASSIGN_OR_RETURN(library, host::PluginLibrary::open(options.plugin));
    ravencal_config config = library->default_config();
    config.step_budget_ns = 0;  // this machine is not the robot's
    if (options.telemetry.size() >= sizeof config.telemetry_name) {
      return core::Error{core::ErrorCode::kUsage, "--telemetry: the name is too long"};
    }
    std::memcpy(config.telemetry_name, options.telemetry.c_str(), options.telemetry.size() + 1);
    RAVENCAL_ASSIGN_OR_RETURN(instance, host::PluginInstance::create(*library, config));
    if (!options.weights.empty()) RAVENCAL_RETURN_IF_ERROR(instance->load(options.weights));
    instance->api().enable(instance->get(), 1);
    return {};
  }

  /// Joints 1 to 3 as the controller goes on with them.
  void correct(const RavenMessage& at_hook, std::int64_t t_ns, bool homed, Vector3d& joints_ji) {
    if (!instance) return;
    host::fill_state(host::to_si(at_hook), t_ns, homed, state);
    if (instance->api().step(instance->get(), &state, &output) < 0) return;
    joints_ji = Eigen::Map<const Eigen::Vector3f>(output.jpos_ji).cast<double>();
  }

  [[nodiscard]] Vector3d uncorrected(const Vector3d& desired_ji) const {
    if (!instance) return desired_ji;
    const Eigen::Vector3f desired = desired_ji.cast<float>();
    Eigen::Vector3f result;
    instance->api().uncorrect_desired(instance->get(), desired.data(), result.data());
    return result.cast<double>();
  }

  void observe(const RavenMessage& published, std::int64_t t_ns, bool homed) {
    if (!instance) return;
    host::fill_state(host::to_si(published), t_ns, homed, state);
    instance->api().observe_cycle_end(instance->get(), &state);
  }
};

struct VirtualController::Impl {
  Impl(physics::RavenTwin made, const physics::Plant& plant, const VirtualControllerOptions& given)
      : twin(std::move(made)),
        gold(plant.robot.arm == "gold"),
        cycle_s(1.0 / plant.robot.control_rate_hz),
        swapped(given.swapped_commands) {}

  void update_runlevel();
  [[nodiscard]] const RavenMessage& finish_cycle(const Vector3d& measured_ji);
  void complete(RavenMessage& message) const;
  void write_corrected(const Vector3d& measured_ji, RavenMessage& message) const;
  [[nodiscard]] OperatingState operating() const;

  physics::RavenTwin twin;
  PluginHook plugin;
  JointCommands commands;
  bool gold;
  double cycle_s;
  bool swapped;
  bool emergency_stop = true;
  bool start_pressed = false;
  bool pedal_down = false;
  bool homed = false;
  std::int32_t runlevel = kEmergencyStop;
  int init_cycles = 0;
  bool seed_desired = false;  // the run level has changed
  Vector3d desired_ji = Vector3d::Zero();
  RavenMessage at_hook{};
  CycleOutput output;
};

core::Result<VirtualController> VirtualController::create(const physics::Plant& plant,
                                                          const VirtualControllerOptions& options) {
  physics::TwinOptions twin_options;
  twin_options.seed = options.seed;
  twin_options.homing_seed = options.homing_seed;
  RAVENCAL_ASSIGN_OR_RETURN(physics::RavenTwin twin,
                            physics::RavenTwin::create(plant, twin_options));
  auto impl = std::make_unique<Impl>(std::move(twin), plant, options);
  RAVENCAL_RETURN_IF_ERROR(impl->plugin.open(options));
  if (options.homed) {
    impl->twin.home();
    impl->homed = impl->twin.homed();
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

void VirtualController::command(ArmName arm, CommandKind kind, const Vector3d& joints) noexcept {
  const bool for_gold = (arm == ArmName::kGold) != impl_->swapped;
  if (for_gold == impl_->gold && impl_->runlevel == kPedalDown) impl_->commands.take(kind, joints);
}

void VirtualController::Impl::update_runlevel() {
  const std::int32_t before = runlevel;
  if (emergency_stop) {
    runlevel = kEmergencyStop;
  } else if (runlevel == kEmergencyStop && start_pressed) {
    runlevel = kInit;
    init_cycles = 0;
    if (!homed) twin.start_homing();
  } else if (runlevel == kInit) {
    ++init_cycles;
    homed = homed || twin.homed();
    if (homed && init_cycles >= kInitCycles) runlevel = kPedalUp;
  }
  start_pressed = false;
  if (runlevel == kPedalUp || runlevel == kPedalDown) runlevel = pedal_down ? kPedalDown : kPedalUp;
  if (runlevel != before) commands.forget();
  seed_desired = runlevel != before;
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
  message[core::catalogue_index(RavenField::kSublevel, 0)] = homed ? 1 : 0;  // robot_ready()
  message[core::catalogue_index(RavenField::kType, 0)] = gold ? kGoldArm : kGreenArm;
  message[core::catalogue_index(RavenField::kType, 0, true)] = gold ? kGreenArm : kGoldArm;
  swap_mechanism_fields(message);
}

/// The corrected joints and all that the controller computes from them.
void VirtualController::Impl::write_corrected(const Vector3d& measured_ji,
                                              RavenMessage& message) const {
  physics::SlotVector joints{};
  for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
    double& value = message[core::catalogue_index(RavenField::kJpos, slot)];
    if (slot < 3) value = as_float(measured_ji[static_cast<Eigen::Index>(slot)] * kDegPerRad);
    joints[slot] = value / kDegPerRad;
    if (slot < 3) {
      message[core::catalogue_index(RavenField::kJposD, slot)] =
          as_float(desired_ji[static_cast<Eigen::Index>(slot)] * kDegPerRad);
    }
  }
  const physics::ToolPose pose =
      physics::forward_kinematics(gold ? physics::Arm::kGold : physics::Arm::kGreen, joints);
  for (const RavenField field : {RavenField::kPos, RavenField::kPosD}) {
    for (std::size_t i = 0; i < 3; ++i)
      message[core::catalogue_index(field, i)] = static_cast<double>(pose.position_um[i]);
  }
  for (const RavenField field : {RavenField::kOri, RavenField::kOriD}) {
    for (std::size_t i = 0; i < 9; ++i)
      message[core::catalogue_index(field, i)] = as_float(pose.rotation[i]);
  }
}

/// The control law of this run level.
const RavenMessage& VirtualController::Impl::finish_cycle(const Vector3d& measured_ji) {
  if (runlevel == kInit && !homed) {
    desired_ji = measured_ji;
    return twin.end_homing_cycle();
  }
  if (runlevel != kPedalDown) {
    desired_ji = measured_ji;
    return twin.end_braked_cycle(runlevel == kPedalUp);
  }
  if (seed_desired) desired_ji = measured_ji;
  desired_ji = commands.advance(desired_ji, cycle_s);
  return twin.end_cycle(plugin.uncorrected(desired_ji));
}

const CycleOutput& VirtualController::cycle() noexcept {
  Impl& robot = *impl_;
  robot.update_runlevel();
  const std::int64_t t_ns = robot.twin.t_ns();
  robot.at_hook = robot.twin.begin_cycle();
  robot.complete(robot.at_hook);
  Vector3d measured = robot.twin.estimate_ji();
  robot.plugin.correct(robot.at_hook, t_ns, robot.homed, measured);
  const physics::Truth truth = robot.twin.truth();

  CycleOutput& out = robot.output;
  out.message = robot.finish_cycle(measured);
  if (robot.runlevel != kInit || robot.homed) robot.write_corrected(measured, out.message);
  robot.complete(out.message);
  robot.plugin.observe(out.message, t_ns, robot.homed);
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
